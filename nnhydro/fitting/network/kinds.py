"""Kinds of motion: recordings ordered by how far their links get on the way they go, and blocks of neighbours in that order.

    progress = |displacement| / path,  of the outer ends of the links, one for a motion that never turns back, near zero for an oscillation

A model that is watched on a block of one kind has to predict motions unlike those that it was fitted to. Source: ours.
"""

from collections.abc import Sequence

import torch

from nnhydro.fitting.linear.several_arms import arm_of
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.splitting import Unit

FARTHEST = 1.0  # of steady runs
TINY = 1e-9  # m
PLACES = (0.0, 1.0, 0.5)  # in the order: those that turn back most, those that never do, those between


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


def of_one_kind(chosen: Sequence[Unit], arm: Arm, share: float, number: int) -> tuple[int, ...]:
    """Return the indices of a `share` of the units `chosen`, neighbours in kind, whole groups; `number` says which block."""
    groups = sorted({unit.group for unit in chosen})
    if len(groups) < 2:
        return ()
    mean = {group: [progress(unit, arm) for unit in chosen if unit.group == group] for group in groups}
    order = sorted(groups, key=lambda group: sum(mean[group]) / len(mean[group]))
    count = max(1, round(share * len(order)))
    start = round(PLACES[number % len(PLACES)] * (len(order) - count))
    block = set(order[start:start + count])
    return tuple(i for i, unit in enumerate(chosen) if unit.group in block)
