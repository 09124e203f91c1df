"""What `nnhydro check` prints: the recordings, what is odd, the arm, and a verdict with the next command."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

from nnhydro.recordings.checks.oddity import Oddity
from nnhydro.recordings.survey import Survey
from nnhydro.report.screen import say, table

SHOWN = 40  # recordings in the table; the rest is counted


def _plural(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"


def _print_recordings(found: Survey) -> None:
    cut = "-" if found.how is None or found.how.low_pass is None else f"{found.how.low_pass.cutoff_hz:.3g}"
    odd = Counter(oddity.recording for oddity in found.oddities)
    rows = [[e.name, str(e.rows), f"{e.duration_s:.4g}", f"{e.rate_hz:.4g}", f"{e.jitter:.1%}", " ".join(e.given),
             " ".join(e.derived) or "-", cut, str(odd[e.name] or "-")] for e in found.entries[:SHOWN]]
    if rows:
        headings = ["recording", "rows", "s", "Hz", "jitter", "given", "derived", "cut-off Hz", "oddities"]
        table(_plural(len(found.entries), "recording"), headings, rows)
    if len(found.entries) > SHOWN:
        say(f"... and {len(found.entries) - SHOWN} more recordings.")
    for name, runs in found.tables:
        say(f"Steady table {name}: {_plural(runs, 'run')}{f', {odd[name]} oddities' if odd[name] else ''}.")


def merged(oddities: Sequence[Oddity]) -> list[str]:
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
    rows = [[f"link {i}", f"{link.slenderness:.3g}", f"{link.top_speed_m_s:.3g}", "-" if link.reynolds is None else f"{link.reynolds:.2g}",
             f"{link.travel:.3g}"] for i, link in enumerate(found.links, 1)]
    if rows:
        title = "How the tips move (a dry arm)" if found.links[0].reynolds is None else "How the tips move through the water"
        table(title, ["", "L/D", "top speed of the tip, m/s", "Reynolds", "longest stroke, D"], rows)
    if found.floor is not None:
        std = ", ".join(f"{x:.2g}" for x in found.floor.std)
        say(f"Repeats: a perfect model would score {found.floor.error:.3g} (sum|error| / sum|torque|); noise {std} N m (joint 1, 2, ...).")


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
    """Print the survey of the campaign in the folder `campaign`."""
    _print_recordings(found)
    for line in merged(found.oddities):
        say(line)
    _print_arm(found)
    say(verdict(found))
    if not found.errors:
        say(f"Next: nnhydro benchmark {campaign} --out compared")


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
