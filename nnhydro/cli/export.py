"""`nnhydro export`: a stored model as a file for a controller or another simulator."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from nnhydro.report.screen import JSON, QUIET, conclude, emit, say, table

if TYPE_CHECKING:
    from nnhydro.models.torque_model import TorqueModel

FORMATS = ("onnx", "mujoco", "curves")


def _for_controllers(model: Path, without: bool) -> "TorqueModel":
    """The model in a folder; refused where it holds faults of sensors, which no controller may be given, unless these are left off."""
    from nnhydro.errors import ModelError
    from nnhydro.models.storage import load_model
    from nnhydro.models.without_instruments import sensor_faults, without_instruments

    loaded = load_model(model)
    faults = sensor_faults(loaded)
    if faults and not without:
        raise ModelError(f"{model}: holds faults of the rig's torque sensors ({', '.join(faults)}): a controller would act on what the "
                         "sensors read, not on what the arm needs: add --without-instruments, which leaves them off")
    return without_instruments(loaded)


def _onnx(model: Path, out: Path, precision: str, loaded: "TorqueModel") -> tuple[dict[str, Any], str]:
    """Write one step in time; return what it is told of and the verdict."""
    from nnhydro.models.export.onnx_file import export_onnx
    from nnhydro.models.storage import DIGEST

    told = export_onnx(loaded, out, precision, (model / DIGEST).read_text(encoding="utf-8").strip())
    return told, f"{told['model']} is one step in time in {out}, checked against the model; {out}.json says how to feed it."


def _show_onnx(told: dict[str, Any], out: Path, precision: str) -> None:
    rows = [[x["name"], " x ".join(map(str, x["shape"])), x["unit"], way.removesuffix("s"), x["meaning"]]
            for way in ("inputs", "outputs") for x in told[way]]
    table(f"{out}: {told['model']}, {precision} precision", ["name", "shape", "unit", "", "meaning"], rows)
    if told["memory"]:
        say(told["memory"])


def _mujoco(loaded: "TorqueModel", out: Path) -> tuple[dict[str, Any], str]:
    from nnhydro.exchange.mujoco import mujoco_xml
    from nnhydro.files import write_own

    made = mujoco_xml(loaded)
    write_own(out, made.xml)
    said = f"{out} holds {len(made.holds)} parts of the model; MuJoCo cannot hold {len(made.lacks)}, listed in it."
    return {"holds": list(made.holds), "lacks": list(made.lacks)}, said


def _curves(loaded: "TorqueModel", out: Path) -> tuple[dict[str, Any], str]:
    from nnhydro.exchange.curves import curves_csv
    from nnhydro.files import write_own

    text = curves_csv(loaded)
    write_own(out, text)
    return {"rows": text.count("\n") - 1}, f"C_D and C_M over the distance travelled, {text.count(chr(10)) - 1} rows, in {out}."


def export(
    model: Path = typer.Argument(help="Folder of a model that identify, train or diagnose wrote."),
    out: Path = typer.Option(..., "--out", help="File to write, such as arm.onnx; arm.onnx.json beside it says how to feed it."),
    kind: str = typer.Option("onnx", "--format", help="onnx (any model), mujoco (physics, as MJCF) or curves (coefficients, as CSV)."),
    precision: str = typer.Option("double", "--precision", help="Of onnx: double, or single (off by some 1e-6 of the torque)."),
    without_instruments: bool = typer.Option(False, "--without-instruments", help="Leave off faults of the rig's torque sensors (offset, "
                                             "drift, delay, ...): they are no part of the arm."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Write a model for others: one step in time for a controller, a MuJoCo file, or its coefficients as a table."""
    from nnhydro.errors import require

    require(kind in FORMATS, f"--format {kind!r}: one of {', '.join(FORMATS)}")
    loaded = _for_controllers(model, without_instruments)
    told, verdict = _onnx(model, out, precision, loaded) if kind == "onnx" else (_mujoco if kind == "mujoco" else _curves)(loaded, out)
    if json:
        emit({"file": str(out), **told})
        return
    if kind == "onnx":
        _show_onnx(told, out, precision)
    for what in ("holds", "lacks"):
        for line in told.get(what, []):
            say(f"{'holds ' if what == 'holds' else 'cannot hold '} {line}")
    conclude(verdict)
