"""`nnhydro identify`: fit a physics model's coefficients to a campaign."""

from pathlib import Path

import typer

from nnhydro.cli.terminal.output import (
    CUTOFF,
    JSON,
    MAP,
    QUIET,
    conclude,
    emit,
    nothing_to_hold_out,
    say,
    shell_words,
    show,
    use_of,
    warn_of_errors,
    without_bulk,
)


def identify(
    campaign: Path = typer.Argument(help="Folder of the campaign (arm.yaml, recordings/, steady/)."),
    out: Path = typer.Option(..., "--out", help="Folder to write the model to."),
    model: str = typer.Option("constant", "--model", help="rigid, textbook, drag-only, constant or state."),
    dry: Path | None = typer.Option(None, "--dry", help="Model folder of the same arm in air: its values and intervals are priors."),
    cutoff: float | None = CUTOFF,
    seed: int = typer.Option(0, "--seed", help="Seed of the bootstrap."),
    column_map: Path | None = MAP,
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Fit masses, friction and water coefficients to a campaign.

    What arm.yaml states is fitted within its stated uncertainty. The 95 % intervals come from a bootstrap over recordings.
    """
    from nnhydro.fitting.dry_model import dry_model
    from nnhydro.fitting.dry_model import identify_in_water as fit_in_water
    from nnhydro.fitting.identify import identify as fit
    from nnhydro.models.storage import DIGEST, save_model
    from nnhydro.recordings.campaign import verify_campaign
    from nnhydro.report.models.parameter_sheet import model_sentence, parameter_sheet
    from nnhydro.runtime.files import check_folder

    check_folder(out, DIGEST)
    opened = verify_campaign(campaign, column_map)
    unusable = warn_of_errors(opened)
    fitted = fit(opened, model, cutoff, seed) if dry is None else fit_in_water(opened, dry_model(dry), model, cutoff, seed)
    save_model(fitted, out)
    if json:
        emit({"model": str(out), **without_bulk(fitted.fit)})
        return
    if fitted.fit.get("parameters"):
        show(parameter_sheet(fitted))
    for line in fitted.fit.get("warnings", []):
        say(f"warning {line}")
    folder = shell_words(campaign, column_map)
    if unusable or fitted.fit.get("warnings"):
        conclude(model_sentence(fitted), [out],
                 f"nnhydro check {folder}, then nnhydro diagnose {folder} --out diagnosis   (what is wrong, and what is missing?)")
        return
    if nothing_to_hold_out(len(opened.names), len(opened.steady)):
        conclude(model_sentence(fitted), [out], use_of(out, campaign, column_map))
        return
    conclude(model_sentence(fitted), [out],
             f"nnhydro benchmark {folder} --out compared   (how good is it on recordings that no fit has seen?)")
