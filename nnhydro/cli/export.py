"""`nnhydro export`: a stored model as a file for a controller or another simulator."""

from pathlib import Path
from typing import Any

import typer

from nnhydro.report.screen import JSON, QUIET, conclude, emit, say, table

FORMATS = ("onnx", "c", "mujoco", "curves")


def _step(model: Path, out: Path, kind: str, precision: str, bare: bool) -> tuple[dict[str, Any], str]:
    """Write one step in time; return what it is told of and the verdict."""
    from nnhydro.deployment.files import export_step
    from nnhydro.models.storage import DIGEST, load_model

    digest = (model / DIGEST).read_text(encoding="utf-8").strip()
    told = export_step(load_model(model), out, kind, precision, digest, bare)
    if kind == "c":
        return told, f"{told['model']} is one step in time in {out}, checked against the model; try it with {told['test_vector']}."
    return told, f"{told['model']} is one step in time in {out}, checked against the model; {out}.json says how to feed it."


def _show_onnx(told: dict[str, Any], out: Path, precision: str) -> None:
    rows = [[x["name"], " x ".join(map(str, x["shape"])), x["unit"], way.removesuffix("s"), x["meaning"]]
            for way in ("inputs", "outputs") for x in told[way]]
    table(f"{out}: {told['model']}, {precision} precision", ["name", "shape", "unit", "", "meaning"], rows)
    if told["memory"]:
        say(told["memory"])


def _mujoco(model: Path, out: Path) -> tuple[dict[str, Any], str]:
    from nnhydro.exchange.mujoco import mujoco_xml
    from nnhydro.exchange.written import write_file
    from nnhydro.models.storage import load_model

    made = mujoco_xml(load_model(model))
    write_file(out, made.xml)
    said = f"{out} holds {len(made.holds)} parts of the model; MuJoCo cannot hold {len(made.lacks)}, listed in it."
    return {"holds": list(made.holds), "lacks": list(made.lacks)}, said


def _curves(model: Path, out: Path) -> tuple[dict[str, Any], str]:
    from nnhydro.exchange.curves import curves_csv
    from nnhydro.exchange.written import write_file
    from nnhydro.models.storage import load_model

    text = curves_csv(load_model(model))
    write_file(out, text)
    return {"rows": text.count("\n") - 1}, f"C_D and C_M over the distance travelled, {text.count(chr(10)) - 1} rows, in {out}."


def export(
    model: Path = typer.Argument(help="Folder of a model that identify, train or diagnose wrote."),
    out: Path = typer.Option(..., "--out", help="File to write, such as arm.onnx; arm.onnx.json beside it says how to feed it."),
    kind: str = typer.Option("onnx", "--format", help="onnx or c (any model, one step in time), mujoco (physics, as MJCF) or curves "
                             "(coefficients, as CSV)."),
    bare: bool = typer.Option(False, "--without-instruments", help="Of onnx and c: leave out found faults of sensors and drives."),
    precision: str = typer.Option("double", "--precision", help="Of onnx and c: double, or single (off by some 1e-6 of the torque)."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Write a model for others: one step in time for a controller, a MuJoCo file, or its coefficients as a table."""
    from nnhydro.errors import require

    require(kind in FORMATS, f"--format {kind!r}: one of {', '.join(FORMATS)}")
    require(kind in ("onnx", "c") or not bare, f"--without-instruments belongs to --format onnx and c, not to {kind}")
    told, verdict = (_step(model, out, kind, precision, bare) if kind in ("onnx", "c") else
                     (_mujoco if kind == "mujoco" else _curves)(model, out))
    if json:
        emit({"file": str(out), **told})
        return
    if kind == "onnx":
        _show_onnx(told, out, precision)
    for what, said in (("holds", "holds "), ("lacks", "cannot hold"), ("left_out", "left out")):
        for line in told.get(what, []):
            say(f"{said} {line}")
    conclude(verdict)
