"""`FILE.onnx` for a controller and `FILE.onnx.json` that says how to feed it.

The graph is one step in time (step.py): belt, gears, baseline, features, every member of an ensemble and all scaling are inside. Before it
is written it is held against the model: at random states, and step by step along runs from rest and under tow.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.deployment.onnx.expressions import Program
from nnhydro.deployment.onnx.step import NAMES, Step
from nnhydro.deployment.onnx.tracing import Objects, trace
from nnhydro.errors import ModelError, missing_extra, require
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.models.without_instruments import sensor_faults
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion, trial_runs
from nnhydro.runtime.files import json_text, write_own
from nnhydro.runtime.stamp import refuse_foreign

SCHEMA = "nnhydro/onnx/1"
OPSET = 18
PRECISIONS = {"double": np.float64, "single": np.float32}
REMEMBERING = ("travel", "low-pass", "lowpass", "history")  # feature sets
STATES, ROWS, SEED = 40, 30, 0
CLOSE = 1e-9  # of the rms torque: between the recorded scalars and torch, both in double precision
UNITS = {"q": ("rad", "joint angles, joint-relative"), "qd": ("rad/s", "joint rates"), "qdd": ("rad/s^2", "joint accelerations"),
         "u0": ("m/s", "carriage speed"), "du0": ("m/s^2", "carriage acceleration"), "dt": ("s", "time since the step before"),
         "wake": ("m/s", "memory of the wake, as the step before gave it: memories x links x strips"),
         "memory": ("SI", "what the step before gave as memory_next; not read where dt is negative")}
OUTPUTS = {"tau": ("N m", "torques that the sensors read, before any filter"), "std": ("N m", "their standard deviation"),
           "wake_next": ("m/s", "memory for the step that follows"), "memory_next": ("SI", "memory for the step that follows")}
MEMORY = ("Start from rest: wake = 0 and dt = 0 in the first step. Start under way (carriage or arm already moving steadily): dt = 1e9 in "
          "the first step. Then dt is the time since the step before and wake its wake_next.")
BEGIN = ("dt = -1 in the first step: what stands still then starts in water at rest, what moves has moved for ever. Memory is not read in "
         "it (give zeros). Then dt is the time since the step before and memory its memory_next.")


@final
@dataclass(frozen=True, eq=False)
class RecordedGraph:
    """A model as scalars: the program of one step, its outputs by name, and how far it is from the model."""

    step: Any  # Step, or deployment/step.py's
    program: Program
    outputs: dict[str, Objects]
    deviation: dict[str, float]

    @property
    def has_memory(self) -> bool:
        """Return whether a step needs the memory of the one before."""
        return "wake_next" in self.outputs or "memory_next" in self.outputs


def _states(step: Step, count: int) -> list[list[Tensor]]:
    """Random inputs in every direction, at speeds of tow tanks."""
    random = torch.Generator().manual_seed(SEED)
    size = {"q": 1.5, "qd": 1.0, "qdd": 3.0, "u0": 0.4, "du0": 0.5, "wake": 0.3}
    return [[torch.full(shape, 0.01, dtype=torch.float64) if name == "dt" else
             size[name] * torch.randn(shape, generator=random, dtype=torch.float64) for name, shape in step.shapes().items()]
            for _ in range(count)]


def run_steps(step: Step, motion: Motion) -> Tensor:
    """Return the torques (n, links) N m of a run in time order, one step a row, the memory handed on."""
    wake, torques = torch.zeros(step.shapes()["wake"], dtype=torch.float64), []
    gaps = torch.diff(motion.t, prepend=motion.t[:1])
    if bool(motion.u0[0] != 0):
        gaps[0] = 1e9
    for row in range(len(motion)):
        tau, *_, wake = step(motion.q[row], motion.qd[row], motion.qdd[row], motion.u0[row:row + 1], motion.du0[row:row + 1],
                             gaps[row:row + 1], wake)
        torques.append(tau)
    return torch.stack(torques)


def _far(got: NDArray[np.float64], want: NDArray[np.float64]) -> float:
    """Largest deviation relative to the rms of what is wanted, NaN counted as infinite."""
    far = float(np.abs(got - want).max() / (np.sqrt((want**2).mean()) + 1e-12))
    return far if np.isfinite(far) else float("inf")


def _remembers(model: TorqueModel) -> bool:
    """Whether one step after the other gives something else than the whole run."""
    step = Step(model, False)
    return not all(_far(run_steps(step, run).numpy(), model.torque(run).numpy()) < CLOSE for run in trial_runs(model.arm.n_links, ROWS))


def memories_of(model: TorqueModel) -> list[str]:
    """Return the parts of `model` that remember the motion before in a way that one step cannot carry, each tried alone."""
    if isinstance(model, LearnedTorque):
        found = [] if model.baseline is None else memories_of(model.baseline)
        return found or [f"the feature set {name!r}" for name in model.feature_names if name in REMEMBERING]
    if isinstance(model, CorrectedSimulation):
        parts = [model.before, model.after, *([] if model.simulation is None else [model.simulation])]
        return list(dict.fromkeys(name for part in parts for name in memories_of(part)))
    if not isinstance(model, StripTheory):
        return []
    bare = replace(model, instruments=())
    found = [name for name, term in model.loads.terms.items() if _remembers(replace(bare, loads=Loads({name: term})))]
    steady = Loads({name: term for name, term in model.loads.terms.items() if name not in found})
    return found + [instrument.id for instrument in model.instruments if _remembers(replace(bare, loads=steady, instruments=(instrument,)))]


def _without(model: TorqueModel, causes: list[str]) -> str:
    """How to get a model that can be exported."""
    if causes and set(causes) <= set(sensor_faults(model)):
        return "it belongs to the rig's sensors: add --without-instruments"
    return "export a network, a hybrid or a baseline without it"


def record(model: TorqueModel) -> RecordedGraph:
    """Return `model` as scalars; raises ModelError where one step cannot give what the model gives for a whole run."""
    with_std = model.std(trial_runs(model.arm.n_links, ROWS)[0]) is not None
    step = Step(model, with_std)
    along = max(_far(run_steps(step, run).numpy(), model.torque(run).numpy()) for run in trial_runs(model.arm.n_links, ROWS))
    if not along < CLOSE:
        causes = memories_of(model)
        who = " and ".join(causes) or "this model"
        raise ModelError(f"one step cannot carry what {who} remember{'s' if len(causes) < 2 else ''} of the motion before: "
                         f"{_without(model, causes)}")
    first, *others = _states(step, STATES)
    program, arrays = trace(step, first)
    names = ["tau", "std", "wake_next"] if with_std else ["tau", "wake_next"]
    outputs = dict(zip(names, arrays, strict=True))
    flat = np.concatenate([x.ravel() for x in arrays])
    got = program.evaluate(list(flat), np.stack([torch.cat([x.ravel() for x in inputs]).numpy() for inputs in others]))
    want = np.stack([torch.cat([x.ravel() for x in step(*inputs)]).numpy() for inputs in others])
    at_states = _far(got, want)
    require(at_states < CLOSE, "this model decides or computes outside torch, so that no fixed graph can stand for it", ModelError)
    memory = {k for name, k in zip(NAMES, _starts(step), strict=True) if name == "wake"}.pop()
    drives = program.dependencies([x for name in names[:-1] for x in outputs[name].ravel()])
    if not any(k >= memory for k in drives & set(range(program.n_inputs))):
        outputs.pop("wake_next")
    return RecordedGraph(step, program, outputs, {"at_states": at_states, "along_runs": along})


def _starts(step: Step) -> list[int]:
    """Number of the first scalar of each input."""
    return [int(x) for x in np.cumsum([0, *(int(np.prod(shape)) for shape in step.shapes().values())])[:-1]]


def sidecar(recorded: RecordedGraph, declared: list[str], precision: str, digest: str) -> dict[str, Any]:
    """Return FILE.onnx.json: names, shapes, units, conventions, how to begin, and which model it is."""
    import onnx

    model, shapes = recorded.step.model, recorded.step.shapes()
    low_pass = model.preparation.low_pass
    return {
        "schema": SCHEMA, "model": getattr(model, "name", model.kind), "kind": model.kind, "model_digest": digest, "precision": precision,
        "opset": OPSET, "arm": model.arm.document(),
        "inputs": [{"name": name, "shape": list(shapes[name]), "unit": UNITS[name][0], "meaning": UNITS[name][1]} for name in declared],
        "outputs": [{"name": name, "shape": list(values.shape), "unit": OUTPUTS[name][0], "meaning": OUTPUTS[name][1]}
                    for name, values in recorded.outputs.items()],
        "memory": (BEGIN if "memory_next" in recorded.outputs else MEMORY) if recorded.has_memory else None,
        "conventions": "q1 from +X, the others relative to the link inboard, counter-clockwise; the carriage moves along +Y; torques are "
                       "what the drives supply, positive along +q, behind belt and gears where the arm has them; inputs that no output "
                       "depends on are left out",
        "filter": None if low_pass is None else f"the model was made from motions low-passed for comparison at {low_pass.cutoff_hz:g} Hz: "
                  "feed rates and accelerations that hold no more noise than that",
        "checked": {"relative_deviation_in_double": recorded.deviation, "states": STATES - 1, "rows_of_runs": 2 * ROWS},
        "versions": {"torch": torch.__version__, "onnx": onnx.__version__}}


def export_onnx(model: TorqueModel, out: Path, precision: str = "double", digest: str = "",
                made: Callable[[], RecordedGraph] | None = None) -> dict[str, Any]:
    """Write `model` (as scalars where `made` makes these) to `out` and what it needs to be told to `out`.json; returns the latter.

    Raises MissingExtraError without the library onnx, ConfigError for an unknown precision, ModelError where the model cannot be exported.
    """
    try:
        import onnx  # noqa: F401
    except ImportError:
        missing_extra("onnx", "onnx", "nnhydro export")
    from nnhydro.deployment.onnx.onnx_graph import onnx_model

    require(precision in PRECISIONS, f"--precision {precision!r}: one of {', '.join(PRECISIONS)}")
    require(not out.is_dir(), f"--out {out}: is a folder: name a file, such as {out / 'model.onnx'}")
    beside = out.with_name(f"{out.name}.json")
    for path in (out, beside):
        refuse_foreign(path)
    recorded = record(model) if made is None else made()
    graph = onnx_model(recorded.program, recorded.step.shapes(), recorded.outputs, PRECISIONS[precision], OPSET, {"model_digest": digest})
    description = sidecar(recorded, [x.name for x in graph.graph.input], precision, digest)
    graph.metadata_props.add(key="nnhydro", value=json_text(description))
    write_own(out, graph.SerializeToString())
    write_own(beside, json_text(description))
    return description
