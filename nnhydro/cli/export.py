"""`nnhydro export`: a stored model as one file for a controller."""

from pathlib import Path

import typer

from nnhydro.report.screen import JSON, QUIET, conclude, emit, say, table


def export(
    model: Path = typer.Argument(help="Folder of a model that identify, train or diagnose wrote."),
    out: Path = typer.Option(..., "--out", help="File to write, such as arm.onnx; arm.onnx.json beside it says how to feed it."),
    kind: str = typer.Option("onnx", "--format", help="onnx."),
    precision: str = typer.Option("double", "--precision", help="double, or single (off by some 1e-6 of the torque)."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Write the model as one step in time: torques of an instant from its motion and, where it has one, the memory of its wake."""
    from nnhydro.errors import require
    from nnhydro.models.export.onnx_file import export_onnx
    from nnhydro.models.storage import DIGEST, load_model

    require(kind == "onnx", f"--format {kind!r}: the one format is onnx")
    told = export_onnx(load_model(model), out, precision, (model / DIGEST).read_text(encoding="utf-8").strip())
    if json:
        emit({"file": str(out), **told})
        return
    rows = [[x["name"], " x ".join(map(str, x["shape"])), x["unit"], way, x["meaning"]]
            for way in ("inputs", "outputs") for x in told[way]]
    table(f"{out}: {told['model']}, {precision} precision", ["name", "shape", "unit", "", "meaning"],
          [[name, shape, unit, way.removesuffix("s"), meaning] for name, shape, unit, way, meaning in rows])
    if told["memory"]:
        say(told["memory"])
    conclude(f"{told['model']} is one step in time in {out}, checked against the model; {out}.json says how to feed it.")
