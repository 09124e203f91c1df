"""What moves besides the joints, as numpy sees it: the heading and the velocity of the base, and that of the water.

    psi(t) = integral of the yaw rate, 0 at the first row, where no heading was measured                      [rad]
    r = velocity of joint 1 through the water, along the axes at rest                                         [m/s]
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.recording import Recording, SteadyTable
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]


def with_heading(r: Recording) -> Recording:
    """Return `r` with the heading of its base, where it turns and none was measured: the integral of the yaw rate, 0 at first.

    Taken over the whole recording, rows without a finite yaw rate bridged, so that its stretches share one heading.
    """
    if r.base is None or r.heading is not None or not np.nan_to_num(r.base[:, 1]).any():
        return r
    good = np.isfinite(r.t) & np.isfinite(r.base[:, 1])
    t, rate = r.t[good], r.base[good, 1]
    turned = np.concatenate([[0.0], np.cumsum(np.diff(t) * (rate[1:] + rate[:-1]) / 2)])
    return replace(r, heading=np.interp(r.t, t, turned), steps=(*r.steps, "heading of the base from its yaw rate"))


def absolute_angles(x: Recording | Segment | SteadyTable) -> Array:
    """Return the joint angles (n, links) rad with the heading of the base in the first one; a recording's after `with_heading`."""
    return x.q if x.heading is None else np.column_stack([x.q[:, 0] + x.heading, x.q[:, 1:]])


def absolute_rates(x: Recording | Segment | SteadyTable, qd: Array) -> Array:
    """Return the joint rates `qd` (n, links) rad/s with the base's yaw rate in the first one."""
    return qd if x.base is None else np.column_stack([qd[:, 0] + x.base[:, 1], qd[:, 1:]])


def through_water(x: Recording | Segment | SteadyTable) -> Array:
    """Return the velocity (n, 2) m/s of joint 1 through the water, along +X and +Y."""
    n = len(x)
    velocity = np.column_stack([np.zeros(n) if x.base is None else x.base[:, 0], np.zeros(n) if x.u0 is None else x.u0])
    return velocity if x.current is None else velocity - x.current


def moving_surroundings(segments: Iterable[Segment]) -> set[str]:
    """Return what moves in `segments` besides the joints and a base along +Y, in words."""
    found: set[str] = set()
    for segment in segments:
        base = None if segment.base is None else segment.base[:, 0]
        channels = {"base motion along +X": base, "heading of the base": segment.heading, "measured current": segment.current}
        found |= {name for name, channel in channels.items() if channel is not None and channel.any()}
    return found
