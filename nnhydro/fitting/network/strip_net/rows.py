"""Stretches of recordings on which a strip net is trained: what the strips do, how their loads reach the torques, what was measured.

Rows are five a period of the cut-off: of half as many, nets learn what the steps do to their memory. Long recordings are cut; before each
piece stand rows that are not compared, within which the strips' memory of what lies before fades.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import final

import numpy as np
import torch
from torch import Tensor, nn

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
        tau = (self.levers @ load[..., None])[..., 0] + self.columns @ arm
        return tau if self.low_pass is None else self.low_pass @ tau


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


def join_runs(runs: Sequence[StripRun]) -> tuple[StripInputs, Tensor, Tensor, Tensor]:
    """Return the strips of several runs side by side: time steps, whether the flow has lasted where they begin, and throughout."""
    longest = max(len(run.keep) for run in runs)

    def side_by_side(parts: list[Tensor]) -> Tensor:
        return torch.cat([nn.functional.pad(z, (0, 0) * (z.dim() - 1) + (0, longest - len(z))) for z in parts], dim=1)

    def flags(name: str) -> Tensor:
        return torch.cat([torch.full((run.given.x.shape[1],), getattr(run, name)) for run in runs])[None, :, None]

    x, r, speeds, plain = (side_by_side([getattr(run.given, field.name) for run in runs]) for field in fields(StripInputs))
    way = side_by_side([run.way.expand(-1, run.given.x.shape[1], 1) for run in runs])
    return StripInputs(x, r, speeds, plain), way, flags("moves"), flags("steady")
