"""`nnhydro diagnose`: what the baseline leaves out of the recordings."""

from pathlib import Path

import typer

from nnhydro.report.screen import JSON, MAP, emit, note, say, table


def diagnose(
    campaign: Path = typer.Argument(help="Folder of the campaign."),
    out: Path = typer.Option(..., "--out", help="Folder for diagnosis.json, report.html, model/ and baseline/."),
    baseline: str = typer.Option("", "--baseline", help="A physics model by name, a model folder, or column (tau*_sim_Nm); constant, or rigid where dry, by default."),
    effects: Path | None = typer.Option(None, "--effects", help="Python file with effects of your own."),
    cutoff: float | None = typer.Option(None, "--cutoff", help="Low-pass cut-off in Hz; chosen from the data where not given."),
    seed: int = typer.Option(0, "--seed", help="Seed of the bootstraps."),
    column_map: Path | None = MAP,
    json: bool = JSON,
) -> None:
    """Is there a mismatch beyond noise and recalibration, where, what physics is left out, and does the model with it predict better?"""
    from nnhydro.diagnosis.engine import diagnose as find
    from nnhydro.effects.catalogue import load_plugin
    from nnhydro.recordings.campaign import verified
    from nnhydro.report.diagnosis_folder import write_diagnosis

    if effects is not None:
        load_plugin(effects)
    opened = verified(campaign, column_map)
    note("fitting the baseline, then every hypothesis beside it")
    result = find(opened, baseline or None, seed, cutoff)
    paths = write_diagnosis(result, opened, out)
    document = result.document()
    if json:
        emit(document)
        return
    rows = [[f["effect"], str(f["joint"] or "arm"), ", ".join(f["class"][1:]) or "-", f"{f['confidence']:.2f}",
             f"{100 * f['heldout']['error_before']:.1f} -> {100 * f['heldout']['error_after']:.1f} %"] for f in document["findings"]]
    if rows:
        table("What is left out", ["effect", "joint", "cannot be told from", "confidence", "left-out error without -> with"], rows)
    say(result.verdict())
    for path in paths:
        say(f"  {path}")
    say(f"Next: nnhydro predict {out / 'model'} {campaign}/unseen/*.csv --out torques")
