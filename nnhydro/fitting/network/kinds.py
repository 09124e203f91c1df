"""Kinds of motion: recordings in two orders, and blocks of neighbours in either of them.

    progress = |displacement| / path               one for a motion that never turns back, near zero for an oscillation
    swing    = sum |dw| D / sum w^2                large where inertia rules: 2 pi / KC times 4/pi for an oscillation, 0 for a steady run

w, dw are speed and acceleration of the links' outer ends. A model that is watched on a block of one kind has to predict motions unlike
those that it was fitted to. Source: the acceleration number after Keulegan & Carpenter (1958); the orders are ours.
"""

from collections.abc import Callable, Sequence
from math import ceil

import torch

from nnhydro.fitting.linear.several_arms import arm_of
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.splitting import Unit

FARTHEST = 1.0  # of steady runs
TINY = 1e-9
Order = Callable[[Unit, Arm], float]


def progress(unit: Unit, arm: Arm) -> float:
    """Return how far the links' outer ends get of the way that they go, 0 to 1; the longest displacement within the recording counts."""
    if unit.steady:
        return FARTHEST
    gone, path = 0.0, 0.0
    for segment in unit.segments():
        flow = Flow(arm_of(unit, arm), Motion.of(segment))
        steps = (flow.A * flow.L + flow.B) * segment.dt
        way = torch.cumsum(steps, dim=0)
        gone += float((way.amax(dim=0) - way.amin(dim=0)).sum())
        path += float(steps.abs().sum())
    return gone / max(path, TINY)


def swing(unit: Unit, arm: Arm) -> float:
    """Return how much of the motion of the links' outer ends is acceleration, over diameters; 0 for steady runs."""
    if unit.steady:
        return 0.0
    push, square = 0.0, 0.0
    for segment in unit.segments():
        flow = Flow(arm_of(unit, arm), Motion.of(segment))
        push += float(((flow.M * flow.L + flow.N).abs() * flow.D).sum())
        square += float((flow.A * flow.L + flow.B).square().sum())
    return push / max(square, TINY**2)


def of_one_kind(chosen: Sequence[Unit], arm: Arm, share: float, place: float, order: Order = progress) -> tuple[int, ...]:
    """Return the indices of a `share` of the units `chosen`, neighbours in `order`, whole groups; `place` 0 to 1: the first to the last."""
    groups = sorted({unit.group for unit in chosen})
    if len(groups) < 2:
        return ()
    value = {group: [order(unit, arm) for unit in chosen if unit.group == group] for group in groups}
    ranked = sorted(groups, key=lambda group: sum(value[group]) / len(value[group]))
    count = max(1, ceil(share * len(ranked) - TINY))
    start = round(place * (len(ranked) - count))
    block = set(ranked[start:start + count])
    return tuple(i for i, unit in enumerate(chosen) if unit.group in block)
