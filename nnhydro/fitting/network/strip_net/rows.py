"""Stretches of recordings on which a strip net is trained: what the strips do, how their loads reach the torques, what was measured.

Rows are five a period of the cut-off: of half as many, nets learn what the steps do to their memory. Long recordings are cut; before each
piece stand rows that are not compared, within which the strips' memory of what lies before fades.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.features.wake import under_way
from nnhydro.fitting.linear.several_arms import arm_of
from nnhydro.models.learned.strip_inputs import StripInputs, arm_columns, drift, rigid_torque, sensor_torque
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit

ROWS, WARM = 400, 80  # of a stretch that are compared, and that stand before them
ROWS_PER_CUTOFF = 5.0  # a period of the cut-off
SHORTEST = 8  # rows that a filter can be run over


@final
@dataclass(frozen=True, eq=False)
class StripRun:
    """A stretch of a recording, every so many rows, float32."""

    unit: int
    given: StripInputs
    way: Tensor  # (t, 1, 1) s between rows, 0 at the first
    levers: Tensor  # (t, joints, strips) N m of loads of 1
    columns: Tensor  # (t, joints, p) N m
    low_pass: Tensor | None  # (t, t)
    left: Tensor  # (t, joints) N m: what the rigid body leaves
    keep: Tensor  # (t,)
    moves: bool  # the flow has lasted where the stretch begins
    steady: bool
    drift: float  # m^2/s^2, the largest

    def torque(self, load: Tensor, arm: Tensor) -> Tensor:
        """Return the torques (t, joints) N m of strip loads (t, strips), as the sensor sees them."""
        return self.sensor_torque(torque_of(load, arm, self.levers, self.columns))

    def sensor_torque(self, tau: Tensor) -> Tensor:
        """Return the torques `tau` (t, joints) N m as the sensor sees them."""
        return tau if self.low_pass is None else self.low_pass @ tau


def torque_of(load: Tensor, arm: Tensor, levers: Tensor, columns: Tensor) -> Tensor:
    """Return the torques (t, joints) N m of strip loads (t, strips) and of the arm's coefficients."""
    return (levers * load[:, None]).sum(dim=2) + columns @ arm


def _stride(segment: Segment) -> int:
    if segment.low_pass is None:
        return -(-len(segment.t) // ROWS)
    return max(1, int(1 / (ROWS_PER_CUTOFF * segment.low_pass.cutoff_hz * segment.dt)))


def _stretches(number: int, segment: Segment, arm: Arm) -> Iterator[StripRun]:
    """Every so many rows of a segment, ROWS at a time; what strips remember fades within the WARM rows before these."""
    flow, stride, low_pass = Flow(arm, Motion.of(segment)), _stride(segment), segment.low_pass
    every, dt = StripInputs.of(flow), segment.dt * stride
    levers, columns = sensor_torque(flow, torch.eye(every.x.shape[1], dtype=torch.float64)[None]), arm_columns(flow)
    left = tensor(segment.tau if segment.tau is not None else 0.0) - tensor(segment.filter(rigid_torque(flow).numpy()))
    count = -(-len(segment.t) // stride)
    for first in range(0, count, ROWS):
        start = max(0, first - WARM)
        rows = slice(start * stride, (first + ROWS) * stride, stride)

        def part(z: Tensor, rows: slice = rows) -> Tensor:
            return z[rows].float().contiguous()

        given = StripInputs(*(part(getattr(every, field.name)) for field in fields(every)))
        n = len(given.x)
        keep, way = torch.from_numpy(segment.keep[rows].copy()), torch.full((n, 1, 1), dt)
        keep[:first - start], way[0] = False, 0.0
        passed = None if low_pass is None or n < SHORTEST else torch.from_numpy(low_pass.apply(np.eye(n), dt)).float()
        if bool(keep.any()):
            yield StripRun(number, given, way, part(levers), part(columns), passed, part(left), keep, start > 0 or under_way(flow),
                      segment.steady, float(part(drift(flow)).max()))


def runs_of(chosen: Sequence[Unit], arm: Arm) -> list[StripRun]:
    """Return the stretches of the units `chosen`."""
    return [run for number, unit in enumerate(chosen) for segment in unit.segments()
            for run in _stretches(number, segment, arm_of(unit, arm))]


@final
@dataclass(frozen=True, eq=False)
class Together:
    """The rows of several runs, those of one time side by side, the longest run first: nothing is filled up."""

    given: StripInputs  # (m, s, ...)
    way: Tensor  # (m, 1, 1) s from the row before, 0 at the first of a run
    before: NDArray[np.int64]  # (m,) the row before, itself at the first
    ends: NDArray[np.int64]  # where the rows of each time end
    lasting: NDArray[np.int64]  # rows in which the flow has lasted
    place: Tensor  # (m,) where the rows lie if the runs are taken one after the other

    @staticmethod
    def of(runs: Sequence[StripRun]) -> "Together":
        """Return the rows of `runs`."""
        lengths = np.array([len(run.keep) for run in runs])
        rank, times = np.argsort(np.argsort(-lengths, kind="stable")), np.arange(lengths.max())
        ends = np.cumsum((lengths > times[:, None]).sum(axis=1))
        begins = np.concatenate([[0], ends[:-1]])
        each = [begins[:n] + r for n, r in zip(lengths, rank, strict=True)]
        place, lasting = np.concatenate(each), [x if run.steady else x[:int(run.moves)] for x, run in zip(each, runs, strict=True)]
        before = np.empty_like(place)
        before[place] = np.concatenate([np.concatenate([x[:1], x[:-1]]) for x in each])
        order = torch.from_numpy(np.argsort(place))

        def side_by_side(parts: Sequence[Tensor]) -> Tensor:
            return torch.cat(list(parts)).index_select(0, order)

        given = StripInputs(*(side_by_side([getattr(run.given, field.name) for run in runs]) for field in fields(StripInputs)))
        return Together(given, side_by_side([run.way for run in runs]), before, ends, np.concatenate(lasting), torch.from_numpy(place))

    def steps(self) -> list[tuple[slice, slice]]:
        """Return the rows before and after each step in time."""
        ends = [0, *self.ends.tolist()]
        return [(slice(a, a + c - b), slice(b, c)) for a, b, c in zip(ends, ends[1:], ends[2:], strict=False)]
