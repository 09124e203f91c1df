"""What `nnhydro check` prints: the recordings, what is odd, the arm, and a verdict with the next command."""

from collections import Counter
from collections.abc import Sequence

from nnhydro.cli.terminal.output import conclude, nothing_to_hold_out, say, show
from nnhydro.conventions import joint_text
from nnhydro.recordings.checks.oddity import Oddity, merge_kinds
from nnhydro.recordings.survey import Survey
from nnhydro.report.survey_table import plural, recordings_sheet, tips_sheet, verdict

SHOWN = 40  # recordings in the table; the rest is counted


def _print_recordings(found: Survey) -> None:
    """Print what the recordings and steady tables hold, and what was done while they were read."""
    odd = Counter(oddity.recording for oddity in found.oddities)
    if found.entries:
        show(recordings_sheet(found, SHOWN))
    if len(found.entries) > SHOWN:
        say(f"... and {len(found.entries) - SHOWN} more recordings.")
    for step, count in Counter(step for entry in found.entries for step in dict.fromkeys(entry.steps)).items():
        say(f"Read: {step}{'' if len(found.entries) == 1 else f' (in {count} of {len(found.entries)})'}.")
    if found.how is not None and found.how.low_pass is not None and found.entries:
        say(f"Cut-off {found.how.low_pass.cutoff_hz:.3g} Hz: models and torques are compared below it. Above, noise hides the "
            "accelerations.")
    for name, runs in found.tables:
        say(f"Steady table {name}: {plural(runs, 'run')}{f', {odd[name]} oddities' if odd[name] else ''}.")


def oddity_lines(oddities: Sequence[Oddity]) -> list[str]:
    """Return one line a kind of finding: the first of its kind, and in how many more recordings it is."""
    lines = []
    for group in merge_kinds(oddities):
        names = list(dict.fromkeys(oddity.recording for oddity in group[1:] if oddity.recording))
        more = f" (also in {', '.join(names[:3])}{f' and {len(names) - 3} more' if len(names) > 3 else ''})" if names else ""
        lines.append(f"{group[0].severity:8}{group[0].message}{more}")
    return lines


def _print_arm(found: Survey) -> None:
    """Print how the tips move, and the noise floor where motions were repeated."""
    if found.links:
        show(tips_sheet(found))
    if found.floor is not None:
        std = ", ".join(f"{x:.2g} N m at joint {j}" for j, x in enumerate(found.floor.std, 1))
        say(joint_text(f"Repeats: a perfect model would score {found.floor.error:.3g} (sum|error| / sum|torque|); noise {std}.",
                       found.sliding))


def print_survey(found: Survey, campaign: str) -> None:
    """Print the survey of the campaign in the folder `campaign`, given as it is typed."""
    _print_recordings(found)
    for line in oddity_lines(found.oddities):
        say(line)
    _print_arm(found)
    conclude(verdict(found), following=next_steps(found, campaign))


def next_steps(found: Survey, campaign: str) -> str:
    """Return what comes next: mending what looks wrong, else a comparison of models, else a fit where nothing can be held out."""
    if any(oddity.severity in ("error", "warning") for oddity in found.oddities):
        return f"correct what is named above, then nnhydro check {campaign}"
    if found.undriven:
        return f"nnhydro diagnose {campaign} --out diagnosis   (without a torque no model can be trained or compared)"
    if nothing_to_hold_out(len(found.entries), len(found.tables)):
        return f"nnhydro identify {campaign} --out my_model   (one recording: nothing can be held out)"
    return f"nnhydro benchmark {campaign} --out compared"
