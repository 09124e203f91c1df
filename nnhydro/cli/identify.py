"""`nnhydro identify`: fit a physics model's coefficients to a campaign."""

from pathlib import Path

import typer

from nnhydro.report.screen import JSON, MAP, emit, say, table


def identify(
    campaign: Path = typer.Argument(help="Folder of the campaign (arm.yaml, recordings/, steady/)."),
    out: Path = typer.Option(..., "--out", help="Folder to write the model to."),
    model: str = typer.Option("constant", "--model", help="rigid, textbook, drag-only, constant or state."),
    cutoff: float | None = typer.Option(None, "--cutoff", help="Low-pass cut-off in Hz; chosen from the data where not given."),
    seed: int = typer.Option(0, "--seed", help="Seed of the bootstrap."),
    column_map: Path | None = MAP,
    json: bool = JSON,
) -> None:
    """Fit Cd and Cm a link, and masses within what is known of them, with 95 % intervals over recordings."""
    from nnhydro.identification.identify import identify as fit
    from nnhydro.models.storage import save_model
    from nnhydro.recordings.campaign import verified

    fitted = fit(verified(campaign, column_map), model, cutoff, seed)
    save_model(fitted, out)
    if json:
        emit({"model": str(out), **fitted.fit})
        return
    rows = [[name, f"{e['value']:.4g}", f"{e['ci95'][0]:.4g} to {e['ci95'][1]:.4g}", e["unit"], e.get("note", "")]
            for name, e in fitted.fit.get("parameters", {}).items()]
    low_pass = fitted.preparation.low_pass
    compared = "as recorded" if low_pass is None else f"low-passed at {low_pass.cutoff_hz:g} Hz"
    if rows:
        table(f"{model}: {fitted.fit['recordings']} recordings, {compared}", ["parameter", "value", "95 % interval", "unit", "note"], rows)
        residual = ", ".join(f"{x:.3g}" for x in fitted.fit["rms_residual_Nm"])
        say(f"What it leaves: rms residual {residual} N m (joint 1, 2, ...) on the recordings it was fitted to.")
    else:
        say(f"{model} has nothing to fit.")
    say(f"Model: {out}")
    say(f"Next: nnhydro benchmark {campaign} --out compared   (is it any good on recordings that it has not seen?)")
