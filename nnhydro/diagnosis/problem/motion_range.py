"""How far and how fast the arm and the water moved in a campaign: what can show, and about which values laws are written."""

from dataclasses import dataclass
from typing import final

import numpy as np

from nnhydro.diagnosis.problem.problem import Problem
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.physics.strips import Strips

Each = tuple[float, ...]  # a value a joint
STRIPS = 4  # strips of a link at which Reynolds numbers are taken
RARE = 0.005  # share of the squared speed below the lowest Reynolds number, and above the highest


@final
@dataclass(frozen=True)
class MotionRange:
    """Ranges of the angles, rad, their means, rms rates, rad/s, the lowest rates, and which joints turn both ways; empty: not known.

    `reynolds` holds the lowest and the highest Reynolds number of the links' strips.
    """

    angles: Each = ()
    means: Each = ()
    rates: Each = ()
    slowest: Each = ()
    reverses: tuple[bool, ...] = ()
    reynolds: tuple[float, float] | None = None

    @classmethod
    def of(cls, problem: Problem) -> "MotionRange":
        """Return the ranges in the recordings of `problem`."""
        segments = [stretch.segment for stretch in problem.stretches]
        q, rates = (np.concatenate([getattr(segment, name)[segment.keep] for segment in segments]) for name in ("q", "qd"))
        most = np.abs(rates).max(axis=0)
        return cls(tuple(np.ptp(q, axis=0).tolist()), tuple(q.mean(axis=0).tolist()), tuple(np.sqrt((rates**2).mean(axis=0)).tolist()),
                   tuple(np.abs(rates).min(axis=0).tolist()),
                   tuple((np.minimum(rates.max(axis=0), -rates.min(axis=0)) > 0.1 * most).tolist()), _reynolds(problem))


def _reynolds(problem: Problem) -> tuple[float, float] | None:
    """Return the Reynolds numbers between which nearly all drag acts; None where no water moves."""
    if problem.arm.dry:
        return None
    found = []
    for stretch in problem.stretches:
        flow = Flow(problem.arm, Motion.of(stretch.segment))
        found.append((Strips.of(flow, STRIPS).w.abs() * flow.D[:, None] / flow.nu).numpy().ravel())
    numbers = np.sort(np.concatenate(found))
    share = np.cumsum(numbers**2)
    if not share[-1] > 0:
        return None
    low, high = (float(numbers[np.searchsorted(share, part * share[-1])]) for part in (RARE, 1 - RARE))
    return low, high
