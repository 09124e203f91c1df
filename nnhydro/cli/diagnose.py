"""`nnhydro diagnose`: what the baseline leaves out of the recordings."""

from pathlib import Path

import typer

from nnhydro.report.screen import JSON, MAP, QUIET, conclude, emit, show


def diagnose(
    campaign: Path = typer.Argument(help="Folder of the campaign."),
    out: Path = typer.Option(..., "--out", help="Folder for diagnosis.json, report.html, model/ and baseline/."),
    baseline: str = typer.Option("", "--baseline", help="A physics model by name, a model folder, or column (the recordings' "
                                 "tau*_sim_Nm); constant, or rigid where dry, by default."),
    effects: Path | None = typer.Option(None, "--effects", help="Python file with effects of your own."),
    cutoff: float | None = typer.Option(None, "--cutoff", help="Low-pass cut-off in Hz; chosen from the data where not given."),
    seed: int = typer.Option(0, "--seed", help="Seed of the bootstraps."),
    column_map: Path | None = MAP,
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Is there a mismatch beyond noise and recalibration, where, what physics is left out, and does the model with it predict better?"""
    from nnhydro.diagnosis.engine import diagnose as find
    from nnhydro.effects.catalogue import load_plugin
    from nnhydro.files import check_folder
    from nnhydro.recordings.campaign import verified
    from nnhydro.report.diagnosis_folder import RESULT, write_diagnosis
    from nnhydro.report.diagnosis_sheets import findings_sheet, location_sheet, parameters_sheet
    from nnhydro.report.progress import steps_on_screen

    check_folder(out, RESULT)
    if effects is not None:
        load_plugin(effects)
    opened = verified(campaign, column_map)
    with steps_on_screen() as report:
        result = find(opened, baseline or None, seed, cutoff, progress=report)
    paths = write_diagnosis(result, opened, out)
    document = result.document()
    if json:
        emit(document)
        return
    for sheet in (findings_sheet(document), parameters_sheet(document), location_sheet(document)):
        if len(sheet):
            show(sheet)
    conclude(result.verdict(), paths, f"nnhydro predict {out / 'model'} {campaign}/unseen/*.csv --out torques")
