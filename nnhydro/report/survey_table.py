"""What `nnhydro check` prints: the recordings, what is odd, the arm, and a verdict with the next command."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

from nnhydro.conventions import joint_text
from nnhydro.recordings.checks.oddity import Oddity
from nnhydro.recordings.survey import Survey
from nnhydro.report.screen import conclude, say, show
from nnhydro.report.sheet import Column, Sheet

SHOWN = 40  # recordings in the table; the rest is counted


def _plural(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"


def recordings_sheet(found: Survey, most: int | None = None) -> Sheet:
    """Return what each recording holds, of the first `most`."""
    cut = None if found.how is None or found.how.low_pass is None else found.how.low_pass.cutoff_hz
    odd, entries = Counter(oddity.recording for oddity in found.oddities), found.entries[:most]
    return Sheet(_plural(len(found.entries), "recording"), (
        Column("recording", [e.name for e in entries], words=True), Column("rows", [e.rows for e in entries]),
        Column("s", [e.duration_s for e in entries], "{:.4g}", "duration_s"),
        Column("Hz", [e.rate_hz for e in entries], "{:.4g}", "rate_hz"), Column("jitter", [e.jitter for e in entries], "{:.1%}"),
        Column("given", [" ".join(e.given) for e in entries], words=True),
        Column("derived", [" ".join(e.derived) or "-" for e in entries], words=True),
        Column("cut-off Hz", [cut] * len(entries), "{:.3g}", "cutoff_hz"), Column("oddities", [odd[e.name] for e in entries])))


def oddities_sheet(found: Survey) -> Sheet:
    """Return what looks wrong, the worst first."""
    return Sheet("What looks wrong", (
        Column("severity", [o.severity for o in found.oddities], words=True),
        Column("check", [o.check for o in found.oddities], words=True),
        Column("recording", [o.recording for o in found.oddities], words=True),
        Column("message", [o.message for o in found.oddities], words=True)))


def tips_sheet(found: Survey) -> Sheet:
    """Return how the tip of each link moves."""
    links = found.links
    title = "How the tips move through the water" if links and links[0].reynolds is not None else "How the tips move (a dry arm)"
    return Sheet(title, (
        Column("link", list(range(1, len(links) + 1)), words=True), Column("L/D", [x.slenderness for x in links], "{:.3g}", "slenderness"),
        Column("top speed of the tip, m/s", [x.top_speed_m_s for x in links], "{:.3g}", "top_speed_m_s"),
        Column("Reynolds", [x.reynolds for x in links], "{:.2g}", "reynolds"),
        Column("longest stroke, D", [x.travel for x in links], "{:.3g}", "travel")))


def _print_recordings(found: Survey) -> None:
    """Print what the recordings and steady tables hold, and what was done while they were read."""
    odd = Counter(oddity.recording for oddity in found.oddities)
    if found.entries:
        show(recordings_sheet(found, SHOWN))
    if len(found.entries) > SHOWN:
        say(f"... and {len(found.entries) - SHOWN} more recordings.")
    for step, count in Counter(step for entry in found.entries for step in dict.fromkeys(entry.steps)).items():
        say(f"Read: {step}{'' if len(found.entries) == 1 else f' (in {count} of {len(found.entries)})'}.")
    for name, runs in found.tables:
        say(f"Steady table {name}: {_plural(runs, 'run')}{f', {odd[name]} oddities' if odd[name] else ''}.")


def merge_kinds(oddities: Sequence[Oddity]) -> list[str]:
    """Return one line a kind of finding: the first of its kind, and in how many more recordings it is."""
    groups: dict[tuple[str, str, str], list[Oddity]] = {}
    for oddity in oddities:
        groups.setdefault((oddity.severity, oddity.check, oddity.where.split(",")[0]), []).append(oddity)
    lines = []
    for group in groups.values():
        names = list(dict.fromkeys(oddity.recording for oddity in group[1:] if oddity.recording))
        more = f" (also in {', '.join(names[:3])}{f' and {len(names) - 3} more' if len(names) > 3 else ''})" if names else ""
        lines.append(f"{group[0].severity:8}{group[0].message}{more}")
    return lines


def _print_arm(found: Survey) -> None:
    """Print how the tips move, and the noise floor where motions were repeated."""
    if found.links:
        show(tips_sheet(found))
    if found.floor is not None:
        std = ", ".join(f"{x:.2g}" for x in found.floor.std)
        say(joint_text(f"Repeats: a perfect model would score {found.floor.error:.3g} (sum|error| / sum|torque|); noise {std} N m "
                       "(joint 1, 2, ...).", found.sliding))


def verdict(found: Survey) -> str:
    """Return the one sentence that sums up."""
    count = Counter(oddity.severity for oddity in found.oddities)
    if found.errors:
        return f"Not usable: {_plural(count['error'], 'error')}. Mend the first and check again."
    if count["warning"]:
        return f"Usable, but look at the {_plural(count['warning'], 'warning')} first: what they name ends up in every fit."
    notes = f" ({_plural(count['note'], 'note')})" if count["note"] else ""
    return f"Usable: nothing looks wrong{notes}."


def print_survey(found: Survey, campaign: str) -> None:
    """Print the survey of the campaign in the folder `campaign`, given as it is typed."""
    _print_recordings(found)
    for line in merge_kinds(found.oddities):
        say(line)
    _print_arm(found)
    conclude(verdict(found), following=next_steps(found, campaign))


def next_steps(found: Survey, campaign: str) -> str:
    """Return what comes next: mending what looks wrong, else a comparison of models, else a fit where nothing can be held out."""
    if any(oddity.severity in ("error", "warning") for oddity in found.oddities):
        return f"mend what is named above, then nnhydro check {campaign}"
    if len(found.entries) + len(found.tables) < 2:
        return f"nnhydro identify {campaign} --out my_model   (one recording: nothing can be held out)"
    return f"nnhydro benchmark {campaign} --out compared"


def document(found: Survey, campaign: str) -> dict[str, Any]:
    """Return the survey as JSON holds it."""
    low_pass = None if found.how is None or found.how.low_pass is None else found.how.low_pass.document()
    return {
        "campaign": campaign, "usable": not found.errors, "verdict": verdict(found),
        "recordings": [asdict(e) | {"rate_hz": e.rate_hz if isfinite(e.rate_hz) else None} for e in found.entries],
        "steady": [{"name": name, "runs": runs} for name, runs in found.tables],
        "low_pass": low_pass, "rates_from": None if found.how is None else found.how.rates_from,
        "oddities": [oddity.document() for oddity in found.oddities],
        "links": [asdict(link) for link in found.links],
        "noise_floor": None if found.floor is None else asdict(found.floor),
    }
