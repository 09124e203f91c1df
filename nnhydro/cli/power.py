"""`nnhydro power`: what a campaign, or one that is only planned, can reveal."""

from pathlib import Path

import typer

from nnhydro.cli.terminal.output import CUTOFF, JSON, MAP, QUIET, conclude, emit, say, shell_words, show, warn_of_errors


def power(
    campaign: Path = typer.Argument(metavar="CAMPAIGN|PLAN", help="Folder of a campaign, or a recipe (YAML) as nnhydro simulate takes it."),
    baseline: str = typer.Option("", "--baseline", help="Name or folder of a physics model; default: constant, or rigid for a dry arm."),
    effects: Path | None = typer.Option(None, "--effects", help="Python file with your own effects."),
    cutoff: float | None = CUTOFF,
    seed: int = typer.Option(0, "--seed", help="Seed of the draws that set the threshold."),
    column_map: Path | None = MAP,
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Find the smallest effects that a campaign would reveal.

    States the smallest size of each effect that would be found, and the share that a refit of the baseline hides.
    For a plan (a recipe) the baseline simulates the motions, with the noise that the recipe states.
    """
    from nnhydro.cli.terminal.progress import steps_on_screen
    from nnhydro.diagnosis.calibration.planned_campaign import simulate_plan
    from nnhydro.diagnosis.calibration.power import power as find
    from nnhydro.effects.plugin import load_plugin
    from nnhydro.recordings.campaign import verify_campaign
    from nnhydro.report.effects.power_table import power_sheet, power_verdict

    if effects is not None:
        load_plugin(effects)
    opened, left_off = simulate_plan(campaign, baseline or None) if campaign.is_file() else (verify_campaign(campaign, column_map), ())
    warn_of_errors(opened)
    with steps_on_screen() as report:
        result = find(opened, baseline or None, seed, cutoff, progress=report).document()
    if json:
        emit(result | {"left_off": list(left_off)})
        return
    if left_off:
        say(f"The baseline lacks these terms of the plan; the simulation omits them: {', '.join(left_off)}")
    show(power_sheet(result))
    following = (f"nnhydro simulate {shell_words(campaign)} --out trial" if campaign.is_file() else
                 f"nnhydro diagnose {shell_words(campaign, column_map)} --out diagnosis")
    conclude(power_verdict(result), following=following)
