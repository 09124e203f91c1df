"""Plant an effect of a stated size in memory: the baseline's own torque, the effect's torque, noise; on a campaign's own motions.

    tau = c_0 + Y theta + x beta + e,   e white before the comparison's filter, its size that of the campaign
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.diagnosis.case import Case
from nnhydro.diagnosis.instances import Instance
from nnhydro.diagnosis.table import columns_of, states
from nnhydro.physics.motion import Motion
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit

Array = NDArray[np.float64]


def low_pass_share(segment: Segment) -> float:
    """Return the standard deviation of white noise of size 1 after the comparison's filter."""
    if segment.low_pass is None:
        return 1.0
    f = np.linspace(0.0, 0.5 / segment.dt, 2000)
    return float(np.sqrt((segment.low_pass.gain(f) ** 2).mean()))


def _noise(segment: Segment, noise: Array, rng: np.random.Generator) -> Array:
    """Noise (n, joints) N m as it is compared, with the standard deviation `noise` (joints,) N m."""
    return np.asarray(segment.seen(rng.standard_normal(segment.q.shape)) / low_pass_share(segment) * noise)


def _planted(segment: Segment, case: Case, effects: Sequence[tuple[Instance, Array]], noise: Array, name: str,
             place: torch.Tensor | None, rng: np.random.Generator) -> Segment:
    tau = np.asarray(segment.seen(case.model.torque(Motion.of(segment)).numpy()))
    for instance, values in effects:
        X = columns_of([instance], case.model, segment, place)
        if instance.spell is not None:
            X = X * instance.spell.mask(name, None if place is None else place.numpy(), states(segment))[:, None, None]
        fixed, own = values[: X.shape[2]], len(instance.own)
        if own == len(fixed) > 1:  # a phase of this recording's own: the same size in another direction
            turn = rng.standard_normal(own)
            fixed = turn * np.linalg.norm(fixed) / np.linalg.norm(turn)
        tau = tau + X[..., : len(fixed)] @ fixed
    return replace(segment, tau=tau + _noise(segment, noise, rng), tau_raw=tau)


def planted(case: Case, effects: Sequence[tuple[Instance, Array]], noise: Array, seed: int) -> Case:
    """Return the case with torques of a healthy arm plus `effects`, each with its linear values, and noise (joints,) N m.

    Values that are a recording's own are drawn anew in each, of the same size.
    """
    def segments(number: int) -> tuple[Segment, ...]:
        unit = case.all_units[number]
        return tuple(_planted(segment, case, effects, noise, unit.name, case.places(unit, k), np.random.default_rng([seed, number, k]))
                     for k, segment in enumerate(unit.segments()))

    def unit_of(number: int, unit: Unit) -> Unit:
        made = segments(number)
        return replace(unit, segments=lambda: made)

    moved = tuple(planted(one, effects, noise * np.sqrt(one.passed_hz / case.passed_hz), seed) for one in case.moved)  # the same noise
    return replace(case, all_units=tuple(unit_of(number, unit) for number, unit in enumerate(case.all_units)), moved=moved)
