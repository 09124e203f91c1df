"""A model as one step in time with explicit memory: sensor torques of an instant, from its motion and what was remembered before.

    tau, memory' = step(q, qd, qdd, u0, du0, dt, memory),      dt < 0: the run begins with this instant, `memory` is not read

Fed with the rows of a recording, one after the other, it gives what the model gives for the whole: on a base that moves along +Y alone, in
water at rest, for no other motion of base or water is an input. What has no place in a step (a delay, an elastic drive) is refused, or left
out with `mechanics` (dynamics/joint_model.py).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod
from typing import Final, final

import numpy as np
import torch
from torch import Tensor

from nnhydro.deployment.onnx.expressions import Program, Value
from nnhydro.deployment.onnx.tracing import Objects, trace
from nnhydro.dynamics.joint_model import FOLLOWS, MECHANICAL, mechanics, steppable
from nnhydro.errors import ModelError, require
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.carried import StepMemory
from nnhydro.physics.motion import Motion, trial_runs

NAMES: Final = ("q", "qd", "qdd", "u0", "du0", "dt", "memory")
NO_INPUTS: Final = "base motion along +X, heading of the base, current: a step is that of a base along +Y, not turned, in water at rest"
ENCODER: Final = "encoder_offset"
BEGIN: Final = -1.0  # s: dt of the first step
WHOLE: Final = 3  # terms, in C, of a learned model: a sum that enters another one is computed once, so that loops run over the strips
CLOSE: Final = 1e-9  # of the rms torque, recorded scalars against torch


@final
@dataclass(frozen=True, eq=False)
class MemoryStep:
    """One step of `model` with all that it remembers; `with_std` says whether it also gives its standard deviation."""

    model: TorqueModel
    with_std: bool

    @cached_property
    def layout(self) -> dict[str, tuple[int, ...]]:
        """Name and shape of each memory, in the order in which they lie in the vector `memory`."""
        zero = torch.zeros(1, self.model.arm.n_links, dtype=torch.float64)
        carried = StepMemory(torch.zeros(1, dtype=torch.float64))
        self._answer(Motion(zero[:, 0], zero, zero, zero, zero[:, 0], zero[:, 0], True, None, carried))
        return {name: tuple(x.shape[1:]) for name, x in carried.after.items()}

    @cached_property
    def tried(self) -> list[list[tuple[list[Tensor], tuple[Tensor, ...]]]]:
        """Inputs and outputs of each step of each trial run."""
        return [list(inputs_along(self, run)) for run in trial_runs(self.model.arm.n_links)]

    @property
    def size(self) -> int:
        """Numbers in the memory."""
        return sum(prod(shape) for shape in self.layout.values())

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Return the shape of each input."""
        n = self.model.arm.n_links
        return dict(zip(NAMES, ((n,), (n,), (n,), (1,), (1,), (1,), (self.size,)), strict=True))

    def memory_parts(self, memory: Tensor) -> dict[str, Tensor]:
        """Return the vector `memory` (size,) by name, one row each."""
        sizes = [prod(shape) for shape in self.layout.values()]
        parts = torch.split(memory, sizes) if sizes else ()
        return {name: part.reshape(1, *shape) for part, (name, shape) in zip(parts, self.layout.items(), strict=True)}

    def _answer(self, motion: Motion) -> tuple[Tensor, ...]:
        tau, std = self.model.torque_and_std(motion) if self.with_std else (self.model.torque(motion), None)
        return (tau[0],) if std is None else (tau[0], std[0])

    def torques(self, q: Tensor, qd: Tensor, qdd: Tensor, u0: Tensor, du0: Tensor, memory: Tensor) -> tuple[Tensor, ...]:
        """Return tau (links,) N m, and its std where there is one, at an instant whose own memory is `memory` (size,)."""
        zero = torch.zeros(1, dtype=torch.float64)
        step = StepMemory(zero, self.memory_parts(memory), True)
        return self._answer(Motion(zero, q[None], qd[None], qdd[None], u0, du0, True, None, step))

    def __call__(self, q: Tensor, qd: Tensor, qdd: Tensor, u0: Tensor, du0: Tensor, dt: Tensor, memory: Tensor) -> tuple[Tensor, ...]:
        """Return tau (links,) N m, its std where there is one, and the next memory (size,)."""
        carried = StepMemory(dt.clamp(min=0.0), self.memory_parts(memory), fresh=dt < 0)
        answer = self._answer(Motion(torch.zeros(1, dtype=torch.float64), q[None], qd[None], qdd[None], u0, du0, True, None, carried))
        following = [carried.after[name].reshape(-1) for name in self.layout]
        return (*answer, torch.cat(following) if following else torch.zeros(0, dtype=torch.float64))


@final
@dataclass(frozen=True, eq=False)
class RecordedStep:
    """A model as scalars: the program of one step, its outputs by name, and how far it is from the model."""

    step: MemoryStep
    program: Program
    outputs: dict[str, Objects]
    deviation: dict[str, float]


def inputs_along(step: MemoryStep, run: Motion) -> Iterator[tuple[list[Tensor], tuple[Tensor, ...]]]:
    """Yield the inputs and outputs of each step of a run in time order."""
    memory = torch.zeros(step.size, dtype=torch.float64)
    for k in range(len(run)):
        dt = run.t[k:k + 1] - run.t[k - 1] if k else torch.tensor([BEGIN], dtype=torch.float64)
        given = [run.q[k], run.qd[k], run.qdd[k], run.u0[k:k + 1], run.du0[k:k + 1], dt, memory]
        answer = step(*given)
        memory = answer[-1]
        yield given, answer


def _far(got: Tensor, want: Tensor) -> float:
    far = float((got - want).abs().max() / (want.square().mean().sqrt() + 1e-12))
    return far if np.isfinite(far) else float("inf")


def whole_sums(model: TorqueModel) -> int:
    """Return from how many terms on sums are kept in C: a physics model is shorter without."""
    return 0 if isinstance(getattr(model, "model", model), StripTheory) else WHOLE


def _strays(step: MemoryStep) -> float:
    """How far the steps of the trial runs are from the runs as a whole."""
    runs = trial_runs(step.model.arm.n_links)
    return _far(torch.stack([answer[0] for run in step.tried for _, answer in run]), torch.cat([step.model.torque(run) for run in runs]))


def not_steppable(model: TorqueModel) -> list[str]:
    """Return the ids of the instruments in `model` that remember what one step cannot carry, each tried alone."""
    if isinstance(model, LearnedTorque):
        return [] if model.baseline is None else not_steppable(model.baseline)
    if isinstance(model, CorrectedSimulation):
        parts = [model.before, model.after, *([] if model.simulation is None else [model.simulation])]
        return list(dict.fromkeys(name for part in parts for name in not_steppable(part)))
    if not isinstance(model, StripTheory):
        return []
    alone = {instrument.id: steppable(replace(model, instruments=(instrument,))) for instrument in model.instruments}
    return [name for name, tried in alone.items() if not _strays(MemoryStep(tried, False)) < FOLLOWS]


def record_step(model: TorqueModel, whole: int = 0) -> RecordedStep:
    """Return `model` as scalars with its memory, sums of `whole` terms or more kept as such (expressions.py).

    Raises ModelError where steps cannot give what the model gives for a whole run, naming what stands in the way.
    """
    made = steppable(model)
    step = MemoryStep(made, made.std(trial_runs(model.arm.n_links)[0]) is not None)
    along = _strays(step)
    if not along < FOLLOWS:
        causes = not_steppable(model)
        raise ModelError(f"one step in time cannot hold what {' and '.join(causes) or 'this model'} remembers of the motion before: "
                         "add --without-instruments, or export a model without that effect")
    pairs = [pair for run in step.tried for pair in run]
    program, arrays = trace(step, pairs[7][0], whole)
    names = ["tau", *(["std"] if step.with_std else []), *(["memory_next"] if step.size else [])]
    outputs = dict(zip(names, arrays, strict=False))
    got = program.evaluate([x for a in arrays for x in a.ravel()], np.stack([torch.cat(given).numpy() for given, _ in pairs]))
    want = torch.stack([torch.cat([x.reshape(-1) for x in answer]) for _, answer in pairs])
    at_states = _far(torch.from_numpy(got), want)
    require(at_states < CLOSE, "this model decides or computes outside torch, so that no fixed program can stand for it", ModelError)
    return RecordedStep(step, program, outputs, {"at_states": at_states, "along_runs": along})


def record_torques(step: MemoryStep) -> tuple[Program, list[Value]]:
    """Return the torques of an instant, and their std, as scalars of q, qd, qdd, u0, du0 and the memory of this instant."""
    given, answer = step.tried[1][7]
    program, arrays = trace(step.torques, [*given[:5], answer[-1]], whole_sums(step.model))
    return program, [x for array in arrays for x in array.ravel()]


def without_instruments(model: TorqueModel) -> tuple[TorqueModel, tuple[str, ...]]:
    """Return the mechanics of `model` as ideal sensors behind its belt and gears would read them, and what was left out.

    An angle that is read with an offset stays: the controller's angles come from the same encoder.
    """
    left_out: list[str] = []
    return mechanics(model, left_out, (*MECHANICAL, ENCODER)), tuple(dict.fromkeys(left_out))


