"""`nnhydro predict`: torques for motions."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from nnhydro.cli.terminal.output import CUTOFF, JSON, MAP, QUIET, conclude, emit, note, say, shell_words

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from nnhydro.models.prediction import PredictedTorque

STRICT = 0.05  # share of the rows that may lie outside where --strict is given
APART = 1e-3  # of the rms of tau1: hub_Mz_Nm differs by more than the rounding of the files


def predict(
    model: Path = typer.Argument(help="Folder of a model that identify, train or diagnose wrote."),
    files: list[Path] = typer.Argument(help="Motions: CSV or Parquet with t_s, q1_rad, ...; torque columns are ignored."),
    out: Path = typer.Option(..., "--out", help="Folder for the torques: one CSV per motion, and a JSON file on how it was computed."),
    strict: bool = typer.Option(False, "--strict", help="Refuse motions that look wrong or lie outside what the model was trained on."),
    hub: bool = typer.Option(False, "--hub", help="Also write force and moment on the base: hub_Fx_N, hub_Fy_N, hub_Mz_Nm."),
    cutoff: float | None = CUTOFF,
    column_map: Path | None = MAP,
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Write the torques that sensors would read, row for row.

    The output includes the faults of this rig's sensors and has one finite row for each row of the input. Missing rates and accelerations
    are derived from the motion, smoothed at a cut-off that is chosen from its noise and pace. The torque is not filtered: check, benchmark
    and diagnose compare torques below the campaign's cut-off, so filter both alike before you compare them.
    """
    from nnhydro.deployment.compiled.torque import quickest
    from nnhydro.dynamics.hub import wrench_columns
    from nnhydro.errors import require
    from nnhydro.models.prediction import predict as torques
    from nnhydro.models.prediction import write_prediction
    from nnhydro.models.storage import load_model
    from nnhydro.recordings.campaign import every_one
    from nnhydro.recordings.readers.column_map import read_column_map
    from nnhydro.recordings.readers.files import read_recording
    from nnhydro.recordings.survey import oddities_of
    from nnhydro.runtime.files import json_text, write_output
    from nnhydro.runtime.stamp import refuse_foreign

    _require_files(files)
    loaded, mapping = load_model(model), None if column_map is None else read_column_map(column_map)
    stems = [file.stem for file in files]
    require(len(set(stems)) == len(stems), f"two motions are called {max(stems, key=stems.count)!r}: rename one, both would be written to "
            f"{out / (max(stems, key=stems.count) + '.csv')}")
    targets = [out / f"{stem}.csv" for stem in stems]
    for target in targets:
        refuse_foreign(target, files)
        refuse_foreign(target.with_suffix(".json"), files)
    motions = every_one(files, lambda file: read_recording(file, loaded.arm, torque=False, column_map=mapping))
    wrenches = [wrench_columns(loaded, motion, cutoff) if hub else None for motion in motions]
    loaded = quickest(loaded, sum(len(motion) for motion in motions))
    odd = [line for motion in motions for line in oddities_of(motion, loaded.arm)]
    predictions = [torques(loaded, motion, cutoff) for motion in motions]
    shares = {prediction.name: prediction.outside_share for prediction in predictions}
    if strict:
        _require_familiar(model, odd, shares)
    written = [write_prediction(prediction, target, files, wrench)
               for prediction, target, wrench in zip(predictions, targets, wrenches, strict=True)]
    for prediction, target in zip(predictions, targets, strict=True):
        write_output(target.with_suffix(".json"), json_text(prediction.document()), files)
    if json:
        emit({"written": [str(path) for path in written], "rows": [len(prediction.t) for prediction in predictions],
              "cutoff_hz": [prediction.cutoff_hz for prediction in predictions], "outside_share": list(shares.values()), "warnings": odd,
              "notes": [line for prediction in predictions for line in prediction.notes]})
        return
    for line in odd:
        note(f"warning {line}")
    for line in (line for prediction in predictions for line in prediction.notes):
        note(f"note {line}")
    for path, prediction in zip(written, predictions, strict=True):
        share = prediction.outside_share
        far = "" if not share else f", {share:.0%} of them outside what the model was trained on (column outside)"
        smooth = "" if prediction.cutoff_hz is None else f", motion smoothed at {prediction.cutoff_hz:.3g} Hz"
        say(f"{path}: {len(prediction.t)} rows{smooth}{far}")
    for prediction, wrench in zip(predictions, wrenches, strict=True):
        _note_moment(prediction, wrench)
    conclude(_verdict(predictions, out), following=_next_steps(model, odd, predictions))


def _require_files(files: list[Path]) -> None:
    """Raise RecordingError where a folder is given in place of the motions in it."""
    from nnhydro.errors import RecordingError
    from nnhydro.recordings.readers.files import FORMATS, is_bag_folder, is_readable
    from nnhydro.runtime.stamp import MODEL_FILES

    for folder in (path for path in files if path.is_dir() and not is_bag_folder(path)):
        inside = (path for place in (folder, folder / "unseen", folder / "recordings") for path in sorted(place.glob("*"))
                  if is_readable(path) and path.name not in MODEL_FILES)
        first = next(inside, None)
        if first is None:
            raise RecordingError(f"{folder}: is a folder and holds no motion ({', '.join(FORMATS)}): give files")
        raise RecordingError(f"{folder}: is a folder: give its files, as in {shell_words(first.parent)}/*{first.suffix}")


def _note_moment(prediction: "PredictedTorque", wrench: "dict[str, NDArray[np.float64]] | None") -> None:
    """Say how far hub_Mz_Nm is from -tau1_Nm, and why."""
    import numpy as np

    if wrench is None:
        return
    apart, size = (float(np.sqrt((x**2).mean())) for x in (wrench["hub_Mz_Nm"] + prediction.tau[:, 0], prediction.tau[:, 0]))
    if apart > APART * size:
        note(f"{prediction.name}: hub_Mz_Nm differs from -tau1_Nm by {apart:.3g} N m rms. Friction, springs and learned torques at "
             "joint 1, the drive, and sensor faults are not part of the wrench.")


def _next_steps(model: Path, odd: list[str], predictions: "list[PredictedTorque]") -> str:
    """What comes next: mending the motions, recording such motions, else a look at the model."""
    if odd:
        return "correct what is named above, then nnhydro predict again   (--strict refuses such motions)"
    far = [prediction.name for prediction in predictions if (prediction.outside_share or 0.0) > STRICT]
    if far:
        return f"record motions like {far[0]} and fit again, or leave out the rows whose column outside is above 0"
    return f"nnhydro gains {shell_words(model)}   (effective damping and inertia)"


def _require_familiar(model: Path, odd: list[str], shares: dict[str, float | None]) -> None:
    """Refuse motions that look wrong or lie outside what the model was trained on."""
    from nnhydro.errors import require

    require(not odd, f"--strict: {odd[0]}{f' (and {len(odd) - 1} more)' if len(odd) > 1 else ''}" if odd else "")
    for name, share in shares.items():
        require(share is not None, f"--strict: {model} does not say what it was trained on: make it again with this version")
        require((share or 0.0) <= STRICT, f"--strict: {name}: {share or 0.0:.0%} of the rows lie outside what the model was trained "
                "on: record such motions, or leave --strict out")


def _verdict(predictions: "list[PredictedTorque]", out: Path) -> str:
    """What was predicted, and how much of it lies outside what the model was trained on."""
    total = sum(len(prediction.t) for prediction in predictions)
    text = f"Torques of {len(predictions)} motion{'s' if len(predictions) > 1 else ''}, {total} rows, in {out}"
    known = [prediction.outside for prediction in predictions if prediction.outside is not None]
    if len(known) < len(predictions):
        return f"{text}; the model does not say what it was trained on."
    share = sum(float((outside > 0).sum()) for outside in known) / max(total, 1)
    return f"{text}; {share:.0%} of the rows lie outside what the model was trained on." if share > 0 else f"{text}."
