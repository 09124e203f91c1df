"""The survey of a campaign as sheets: the recordings, what is odd, the arm; and its verdict."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from math import isfinite
from typing import Any

from nnhydro.recordings.checks.oddity import merge_kinds
from nnhydro.recordings.survey import Survey
from nnhydro.sheet import Column, Sheet

SHOWN = 6  # names in a list


def plural(count: int, word: str) -> str:
    """Return a count with its word."""
    return f"{count} {word}{'' if count == 1 else 's'}"


def recordings_sheet(found: Survey, most: int | None = None) -> Sheet:
    """Return what each recording holds, of the first `most`."""
    cut = None if found.how is None or found.how.low_pass is None else found.how.low_pass.cutoff_hz
    odd, entries = Counter(oddity.recording for oddity in found.oddities), found.entries[:most]
    return Sheet(plural(len(found.entries), "recording"), (
        Column("recording", [entry.name for entry in entries], words=True), Column("rows", [entry.rows for entry in entries]),
        Column("s", [entry.duration_s for entry in entries], "{:.4g}", "duration_s"),
        Column("Hz", [entry.rate_hz for entry in entries], "{:.4g}", "rate_hz"),
        Column("jitter", [entry.jitter for entry in entries], "{:.1%}"),
        Column("given", [" ".join(entry.given) for entry in entries], words=True),
        Column("derived", [" ".join(entry.derived) or "-" for entry in entries], words=True),
        Column("cut-off Hz", [cut] * len(entries), "{:.3g}", "cutoff_hz"), Column("oddities", [odd[entry.name] for entry in entries])))


def oddities_sheet(found: Survey) -> Sheet:
    """Return what looks wrong, the worst first."""
    return Sheet("What looks wrong", (
        Column("severity", [oddity.severity for oddity in found.oddities], words=True),
        Column("check", [oddity.check for oddity in found.oddities], words=True),
        Column("recording", [oddity.recording for oddity in found.oddities], words=True),
        Column("message", [oddity.message for oddity in found.oddities], words=True)))


def tips_sheet(found: Survey) -> Sheet:
    """Return how the tip of each link moves."""
    links = found.links
    title = "How the tips move through the fluid" if links and links[0].reynolds is not None else "How the tips move (a dry arm)"
    return Sheet(title, (
        Column("link", list(range(1, len(links) + 1)), words=True),
        Column("L/D", [link.slenderness for link in links], "{:.3g}", "slenderness"),
        Column("top speed of the tip, m/s", [link.top_speed_m_s for link in links], "{:.3g}", "top_speed_m_s"),
        Column("Reynolds", [link.reynolds for link in links], "{:.2g}", "reynolds"),
        Column("longest stroke, D", [link.travel for link in links], "{:.3g}", "travel")))


def verdict(found: Survey) -> str:
    """Return the one sentence that sums up."""
    count = Counter(group[0].severity for group in merge_kinds(found.oddities))
    if found.errors:
        return f"Not usable: {plural(count['error'], 'error')}. Correct the first and check again."
    if count["warning"]:
        many = count["warning"] > 1
        return (f"Usable, but resolve the {plural(count['warning'], 'warning') if many else 'warning'} first: "
                f"{'they affect' if many else 'it affects'} every fit.")
    notes = f" ({plural(count['note'], 'note')})" if count["note"] else ""
    return f"Usable: nothing looks wrong{notes}."


def verdict_of_all(found: Mapping[str, Survey]) -> str:
    """Return the one sentence that sums up several campaigns, by their names: which can be used, and where to look."""
    groups: dict[str, list[str]] = {"not usable": [], "with warnings": [], "usable, where nothing looks wrong": []}
    for name, each in found.items():
        warned = any(oddity.severity == "warning" for oddity in each.oddities)
        groups["not usable" if each.errors else "with warnings" if warned else "usable, where nothing looks wrong"].append(name)
    parts = [f"{len(names)} {what} ({', '.join(names[:SHOWN])}{', ...' if len(names) > SHOWN else ''})" for what, names in groups.items()
             if names]
    return f"{plural(len(found), 'campaign')}: {'; '.join(parts)}."


def document(found: Survey, campaign: str) -> dict[str, Any]:
    """Return the survey as JSON holds it."""
    low_pass = None if found.how is None or found.how.low_pass is None else found.how.low_pass.document()
    return {
        "campaign": campaign, "usable": not found.errors, "verdict": verdict(found),
        "recordings": [asdict(entry) | {"rate_hz": entry.rate_hz if isfinite(entry.rate_hz) else None} for entry in found.entries],
        "steady": [{"name": name, "runs": runs} for name, runs in found.tables],
        "low_pass": low_pass, "rates_from": None if found.how is None else found.how.rates_from,
        "oddities": [oddity.document() for oddity in found.oddities],
        "links": [asdict(link) for link in found.links],
        "noise_floor": None if found.floor is None else asdict(found.floor),
    }
