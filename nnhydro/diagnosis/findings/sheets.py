"""Findings as sheets, made from their entries in diagnosis.json: their parameters, their rivals."""

from collections.abc import Sequence
from typing import Any

from nnhydro.sheet import Column, Sheet, interval

Document = dict[str, Any]


def place(joint: int | None) -> str:
    """Return the joint as people read it."""
    return "arm" if joint is None else str(joint)


def parameters_sheet(findings: Sequence[Document]) -> Sheet:
    """Return one row per parameter of a finding."""
    rows = [(f["effect"], f["joint"], name, p) for f in findings for name, p in f["parameters"].items()]
    return Sheet("Parameters of the missing physics", (
        Column("effect", [effect for effect, _, _, _ in rows], words=True), Column("joint", [joint for _, joint, _, _ in rows]),
        Column("parameter", [name for _, _, name, _ in rows], words=True), Column("value", [p["value"] for *_, p in rows], "{:.4g}"),
        Column("95 % interval", [tuple(p["ci95"]) for *_, p in rows], interval, "ci95"),
        Column("unit", [p["unit"] for *_, p in rows], words=True)))


def _weight(share: float) -> str:
    return "< 0.001" if share < 0.0005 else f"{share:.3f}"


def rivals_sheet(finding: Document) -> Sheet:
    """Return the rivals of the finding and their posterior weights."""
    rows = finding["rivals"]
    return Sheet(f"Rivals of {finding['effect']}", (
        Column("rival", [r["effect"] for r in rows], words=True),
        Column("joint", [place(r.get("joint")) for r in rows]), Column("weight", [r["support"] for r in rows], _weight, "support")))
