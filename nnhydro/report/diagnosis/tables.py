"""A diagnosis as sheets, made from what diagnosis.json holds: findings, errors, where the residual lies, what came nearest."""

from typing import Any

from nnhydro.diagnosis.findings.sheets import place
from nnhydro.sheet import Column, Sheet, percent

Document = dict[str, Any]


def findings_sheet(document: Document) -> Sheet:
    """Return one row a finding."""
    found = document["findings"]
    return Sheet("Missing physics", (
        Column("effect", [f["effect"] for f in found], words=True), Column("joint", [f["joint"] for f in found], "{}"),
        Column("family", [f["family"] for f in found], words=True),
        Column("alternatives", [", ".join(f["class"][1:]) or None for f in found], words=True),
        Column("confidence", [f["confidence"] for f in found], "{:.2f}"),
        Column("error without", [f["heldout"]["error_before"] for f in found], percent, "error_without"),
        Column("with", [f["heldout"]["error_after"] for f in found], percent, "error_with")))


def nearest_sheet(document: Document) -> Sheet | None:
    """Return the cards that come nearest to what no finding explains, and why they are not said; None where there are none."""
    near = document["unexplained"].get("nearest", [])
    if not near:
        return None
    return Sheet("Effects that came nearest, and why they are not claimed", (
        Column("effect", [x["effect"] for x in near], words=True), Column("joint", [place(x["joint"]) for x in near]),
        Column("gain in score", [x["gain"] for x in near], "{:.1f}", "gain"), Column("why it is not claimed", [x["why"] for x in near],
                                                                                    key="why", words=True)))


def location_sheet(document: Document) -> Sheet:
    """Return where the residual of the baseline lies, one row per joint."""
    where = document["location"]
    return Sheet("Where the baseline and the recordings differ", (
        Column("joint", [x["joint"] for x in where]), Column("share of the residual", [x["share"] for x in where], "{:.0%}", "share"),
        Column("what it depends on", [x["where"] for x in where], key="where", words=True),
        Column("band [Hz]", [tuple(x["band_hz"]) for x in where], lambda b: f"{b[0]:.2g} to {b[1]:.2g}", "band_hz")))


def errors_sheet(document: Document) -> Sheet:
    """Return the error on recordings held out of the fit: baseline, corrected model, noise."""
    given = document["mismatch"].get("error_as_given")
    rows = [] if given is None else [("simulation as it is", given)]
    rows.append(("recalibrated baseline", document["mismatch"]["error"]))
    if document["findings"]:
        rows.append(("corrected model", document["findings"][0]["heldout"]["error_after"]))
    if document["mismatch"]["noise_floor"] is not None:
        rows.append(("noise alone", document["mismatch"]["noise_floor"]))
    return Sheet("Error on recordings held out of the fit", (Column("model", [name for name, _ in rows], words=True),
                                                            Column("error", [error for _, error in rows], percent)))


def recalibrated_sheet(document: Document) -> Sheet | None:
    """Return the baseline's recalibrated coefficients, beside a simulation their changes, one row per link; None where it has none."""
    found = {name: values for name, values in (document.get("recalibrated") or {}).items() if values}
    if not found:
        return None
    links = max(len(values) for values in found.values())
    headings = {"cd": "C_D [-]", "cm": "C_M [-]"}
    absolute = document["mismatch"].get("error_as_given") is None
    whose = "coefficients of the baseline" if absolute else "changes of the simulation's coefficients"
    return Sheet(f"Recalibrated {whose} (no missing physics)", (
        Column("link", list(range(1, links + 1))),
        *(Column(headings.get(name, name), [*values, *[None] * (links - len(values))], "{:.3f}", name) for name, values in found.items())))
