"""`nnhydro export`: a stored model as a file for a controller or another simulator."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from nnhydro.cli.terminal.output import JSON, QUIET, conclude, emit, say, table

if TYPE_CHECKING:
    from nnhydro.models.torque_model import TorqueModel

STEPS = ("onnx", "c", "casadi")
PRECISE = ("onnx", "c")
FORMATS = (*STEPS, "mujoco", "curves")


def _load(model: Path, kind: str, bare: bool) -> "TorqueModel":
    """The model in a folder; refused where a controller would be given faults of its rig's sensors, unless these are left out."""
    from nnhydro.errors import ModelError
    from nnhydro.models.storage import load_model
    from nnhydro.models.without_instruments import sensor_faults

    loaded = load_model(model)
    faults = sensor_faults(loaded) if kind in STEPS and not bare else ()
    if faults:
        raise ModelError(f"{model}: holds faults of the rig's torque sensors ({', '.join(faults)}): a controller would compensate "
                         "the sensors, not the arm: add --without-instruments, which omits them")
    return loaded


def _step(model: Path, loaded: "TorqueModel", out: Path, kind: str, precision: str, bare: bool) -> tuple[dict[str, Any], str]:
    """Write the function of one time step; return its description and the verdict."""
    from nnhydro.deployment.files import export_step
    from nnhydro.models.storage import DIGEST

    digest = (model / DIGEST).read_text(encoding="utf-8").strip()
    written = export_step(loaded, out, kind, precision, digest, bare)
    said = f"{written['model']} was exported as a function of one time step to {out}"
    if kind == "c":
        return written, f"{said}, and checked against the model; test it with {written['test_vector']}."
    if kind == "casadi":
        return written, f"{said}; read it with casadi.Function.deserialize."
    return written, f"{said}, and checked against the model; {out}.json describes its inputs."


def _show_onnx(written: dict[str, Any], out: Path, precision: str) -> None:
    """Print inputs and outputs of one step in time, and what its memory is."""
    rows = [[x["name"], " x ".join(map(str, x["shape"])), x["unit"], way.removesuffix("s"), x["meaning"]]
            for way in ("inputs", "outputs") for x in written[way]]
    table(f"{out}: {written['model']}, {precision} precision", ["name", "shape", "unit", "", "meaning"], rows)
    if written["memory"]:
        say(written["memory"])


def _mujoco(loaded: "TorqueModel", out: Path) -> tuple[dict[str, Any], str]:
    """Write the MuJoCo file; return what it holds and lacks, and the verdict."""
    from nnhydro.deployment.formats.mujoco import mujoco_xml
    from nnhydro.runtime.files import write_output

    made = mujoco_xml(loaded)
    write_output(out, made.xml)
    said = f"{out} holds {len(made.holds)} parts of the model; MuJoCo cannot hold {len(made.lacks)}, listed in it."
    return {"holds": list(made.holds), "lacks": list(made.lacks)}, said


def _curves(loaded: "TorqueModel", out: Path) -> tuple[dict[str, Any], str]:
    """Write the coefficient curves; return their number of rows and the verdict."""
    from nnhydro.deployment.formats.curves import curves_csv
    from nnhydro.runtime.files import write_output

    text = curves_csv(loaded)
    write_output(out, text)
    return {"rows": text.count("\n") - 1}, f"C_D and C_M over the distance travelled, {text.count(chr(10)) - 1} rows, in {out}."


def export(
    model: Path = typer.Argument(help="Folder of a model that identify, train or diagnose wrote."),
    out: Path = typer.Option(..., "--out", help="File to write, such as arm.onnx; arm.onnx.json next to it describes its inputs."),
    kind: str = typer.Option("onnx", "--format", help="onnx, c or casadi (any model, one time step), mujoco (physics, as MJCF) or "
                             "curves (coefficients, as CSV)."),
    precision: str = typer.Option("double", "--precision", help="For onnx and c: double, or single (errors of about 1e-6 of the torque)."),
    without_instruments: bool = typer.Option(False, "--without-instruments", help="For onnx, c and casadi: omit identified faults of "
                                             "torque sensors and drives (offset, drift, delay, ...); they are not part of the arm."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Write a model for a controller or a simulator.

    Writes a function of one time step (ONNX, C, CasADi), a MuJoCo file, or the coefficients as a table.
    """
    from nnhydro.errors import require
    from nnhydro.runtime.registry import choices

    require(kind in FORMATS, f"--format {kind!r} is unknown: {choices(kind, FORMATS)}")
    require(kind in PRECISE or precision == "double", f"--precision {precision!r} belongs to --format onnx and c: {kind} has no other than "
            "double: leave it out")
    require(kind in STEPS or not without_instruments, f"--without-instruments belongs to --format onnx, c and casadi, not to {kind}")
    loaded = _load(model, kind, without_instruments)
    written, verdict = (_step(model, loaded, out, kind, precision, without_instruments) if kind in STEPS else
                     (_mujoco if kind == "mujoco" else _curves)(loaded, out))
    if json:
        emit({"file": str(out), **written})
        return
    if kind == "onnx":
        _show_onnx(written, out, precision)
    for key, said in (("holds", "holds "), ("lacks", "cannot hold "), ("left_out", "left out")):
        for line in written.get(key, []):
            say(f"{said} {line}")
    conclude(verdict)
