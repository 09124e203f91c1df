"""`FILE.onnx` for a controller and `FILE.onnx.json` that says how to feed it.

The graph is one step in time (deployment/step.py): belt, gears, baseline, features, every member of an ensemble and all scaling are inside.
Before it is written it is compared with the model, step by step along runs from rest and under tow.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from nnhydro.deployment.step import NO_INPUTS, RecordedStep, record_step
from nnhydro.errors import missing_extra, require
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import trial_runs
from nnhydro.runtime.files import json_text, write_output
from nnhydro.runtime.stamp import refuse_foreign

SCHEMA: Final = "nnhydro/onnx/2"
OPSET: Final = 18
PRECISIONS: Final = {"double": np.float64, "single": np.float32}
UNITS: Final = {"q": ("rad", "joint angles, joint-relative"), "qd": ("rad/s", "joint rates"), "qdd": ("rad/s^2", "joint accelerations"),
                "u0": ("m/s", "carriage speed"), "du0": ("m/s^2", "carriage acceleration"), "dt": ("s", "time since the step before"),
                "memory": ("SI", "what the step before gave as memory_next; not read where dt is negative")}
OUTPUTS: Final = {"tau": ("N m", "torques that the sensors read, before any filter"), "std": ("N m", "their standard deviation"),
                  "memory_next": ("SI", "memory for the step that follows")}
BEGIN: Final = ("dt = -1 in the first step: what stands still then starts in water at rest, what moves has long moved at that speed. "
                "Memory is not read in it (give zeros). Then dt is the time since the step before and memory its memory_next. After a step "
                "with an input that is NaN or infinite, keep the memory before it: its memory_next holds NaN, or is wrong.")


def sidecar(recorded: RecordedStep, declared: list[str], precision: str, digest: str, left_out: Sequence[str]) -> dict[str, Any]:
    """Return FILE.onnx.json: names, shapes, units, conventions, how to begin, which model it is, and what the file lacks of it."""
    import onnx

    model, shapes = recorded.step.model, recorded.step.shapes()
    low_pass = model.preparation.low_pass
    return {
        "schema": SCHEMA, "model": getattr(model, "name", model.kind), "kind": model.kind, "model_digest": digest, "precision": precision,
        "opset": OPSET, "arm": model.arm.document(),
        "inputs": [{"name": name, "shape": list(shapes[name]), "unit": UNITS[name][0], "meaning": UNITS[name][1]} for name in declared],
        "outputs": [{"name": name, "shape": list(values.shape), "unit": OUTPUTS[name][0], "meaning": OUTPUTS[name][1]}
                    for name, values in recorded.outputs.items()],
        "no_inputs": NO_INPUTS, "left_out": list(left_out), "memory": BEGIN if recorded.step.size else None,
        "conventions": "q1 from +X, the others relative to the link inboard, counter-clockwise; the carriage moves along +Y; torques are "
                       "what the drives supply, positive along +q, behind belt and gears where the arm has them; inputs that no output "
                       "depends on are left out",
        "filter": None if low_pass is None else f"the model was made from motions low-passed for comparison at {low_pass.cutoff_hz:g} Hz: "
                  "feed rates and accelerations that hold no more noise than that",
        "checked": {"relative_deviation_in_double": recorded.deviation, "rows_of_runs": sum(map(len, trial_runs(model.arm.n_links)))},
        "versions": {"torch": torch.__version__, "onnx": onnx.__version__}}


def export_onnx(model: TorqueModel, out: Path, precision: str = "double", digest: str = "",
                left_out: Sequence[str] = ()) -> dict[str, Any]:
    """Write one step of `model` to `out`, and what a user of it needs to know to `out`.json, `left_out` included; returns the latter.

    Raises MissingExtraError without the library onnx, ConfigError for an unknown precision, ModelError where the model cannot be exported.
    """
    try:
        import onnx  # noqa: F401
    except ImportError:
        missing_extra("onnx", "onnx", "nnhydro export")
    from nnhydro.deployment.onnx.onnx_graph import onnx_model

    require(precision in PRECISIONS, f"--precision {precision!r}: one of {', '.join(PRECISIONS)}")
    require(not out.is_dir(), f"--out {out}: is a folder: name a file, such as {out / 'model.onnx'}")
    record = out.with_name(f"{out.name}.json")
    for path in (out, record):
        refuse_foreign(path)
    recorded = record_step(model)
    graph = onnx_model(recorded.program, recorded.step.shapes(), recorded.outputs, PRECISIONS[precision], OPSET, {"model_digest": digest})
    description = sidecar(recorded, [entry.name for entry in graph.graph.input], precision, digest, left_out)
    graph.metadata_props.add(key="nnhydro", value=json_text(description))
    write_output(out, graph.SerializeToString())
    write_output(record, json_text(description))
    return description
