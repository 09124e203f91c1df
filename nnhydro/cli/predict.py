"""`nnhydro predict`: torques for motions."""

from pathlib import Path

import typer

from nnhydro.report.screen import JSON, QUIET, conclude, emit, say


def predict(
    model: Path = typer.Argument(help="Folder of a model that identify, train or diagnose wrote."),
    files: list[Path] = typer.Argument(help="Motions: CSV or Parquet with t_s, q1_rad, ...; torque columns are ignored."),
    out: Path = typer.Option(..., "--out", help="Folder for the torques, one CSV a motion."),
    hub: bool = typer.Option(False, "--hub", help="Also write force and moment on the base: hub_Fx_N, hub_Fy_N, hub_Mz_Nm."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Write what this rig's torque sensors would read for each motion: one finite row for every row of the input."""
    from nnhydro.dynamics.hub import wrench_columns
    from nnhydro.errors import require
    from nnhydro.models.compiled.torque import quickest
    from nnhydro.models.prediction import predict as torques
    from nnhydro.models.prediction_file import write_prediction
    from nnhydro.models.storage import load_model
    from nnhydro.recordings.readers.files import read_recording

    loaded = load_model(model)
    stems = [file.stem for file in files]
    require(len(set(stems)) == len(stems), f"two motions are called {max(stems, key=stems.count)!r}: rename one, both would be written to "
            f"{out / (max(stems, key=stems.count) + '.csv')}")
    motions = [read_recording(file, loaded.arm, torque=False) for file in files]
    wrenches = [wrench_columns(loaded, motion) if hub else None for motion in motions]
    loaded = quickest(loaded, sum(len(motion) for motion in motions))
    predictions = [torques(loaded, motion) for motion in motions]
    written = [write_prediction(prediction, out / f"{prediction.name}.csv", wrench)
               for prediction, wrench in zip(predictions, wrenches, strict=True)]
    if json:
        emit({"written": [str(path) for path in written], "rows": [len(p.t) for p in predictions]})
        return
    for path, prediction in zip(written, predictions, strict=True):
        say(f"{path}: {len(prediction.t)} rows")
    total = sum(len(prediction.t) for prediction in predictions)
    conclude(f"Torques of {len(predictions)} motion{'s' if len(predictions) > 1 else ''}, {total} rows, in {out}.",
             following=f"nnhydro gains {model}   (effective damping and inertia)")
