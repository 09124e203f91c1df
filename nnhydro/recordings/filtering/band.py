"""The band in which model and torque are compared, and the one in which the motion is known.

Both end alike where the motion ends. But a wave or a hum loads an arm that hardly moves: where recordings show lines in the torque above
the motion's band, the comparison goes on to there; and where no motion is known at all, over all of the torque. The motion is smoothed in
its own band: what its sensors add above it is not the arm's.

    line:  P(f) / median of P around f >= LINE  in the torque and not in the acceleration, in a third of the recordings

P is the largest ordinate of the periodogram in a band of frequencies.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.filtering.periodogram import hann_power
from nnhydro.recordings.filtering.preprocessing import resample, stretches
from nnhydro.recordings.filtering.trajectory import HIGHEST_EDGE, LOWEST_EDGE, known_edge
from nnhydro.recordings.recording import Recording

Array = NDArray[np.float64]
LINE = 25.0  # times its surroundings in power: of a hundred ordinates of noise the largest is 5 times their mean
STEP = 1.06  # from band to band: lines of recordings of some ten periods are so wide
AROUND = 6  # bands to either side whose median a line is held against
OFTEN = 1 / 3  # of the recordings, and two at least: where the water moves along a link it shows in no torque
LARGE = 0.01  # of the torque's power in a line: below it nobody would look for a wave
PAST = 1.3  # times the line's frequency: it lies well inside the band


@final
@dataclass(frozen=True)
class Band:
    """Upper edges, Hz, of the comparison of torques and of the motion."""

    torque: float
    motion: float

    def times(self, factor: float) -> "Band":
        """Return the band with both edges times `factor`."""
        return Band(factor * self.torque, factor * self.motion)


def _has_line(x: Array, dt: float, edges: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which bands between `edges` hold a line of the record x (n,), and which of these a large one."""
    f, power = hann_power(x - x.mean(), dt)
    at = np.digitize(f, edges) - 1
    largest = np.array([power[at == k].max(initial=0.0) for k in range(len(edges) - 1)])
    padded = np.pad(largest, AROUND, mode="reflect")
    around = np.array([np.median(np.delete(padded[k:k + 2 * AROUND + 1], AROUND)) for k in range(len(largest))])
    line = largest > LINE * around
    return line, line & (largest > LARGE * power.sum() / 3)  # a line is three ordinates wide


def _external_lines(part: Recording, edges: Array) -> NDArray[np.bool_]:
    """Which bands hold a large line of some torque and none of any angle: what the arm does itself is no wave."""
    dt = float(part.t[1] - part.t[0])
    assert part.tau is not None
    torque = np.any([_has_line(x, dt, edges)[1] for x in part.tau.T], axis=0)
    moved = np.any([_has_line(x, dt, edges)[0] for x in np.diff(part.q, n=2, axis=0).T], axis=0)
    made: NDArray[np.bool_] = torque & ~(moved | np.roll(moved, 1) | np.roll(moved, -1))
    return made


def highest_line(recordings: Iterable[Recording], above: float) -> float:
    """Return the frequency, Hz, above `above` up to which two recordings have lines, where a third of them have some; else 0.

    They need not be the same: what sheds vortices, or turns teeth, has another frequency at another speed.
    """
    count = int(np.ceil(np.log(HIGHEST_EDGE / above) / np.log(STEP)))
    if count < 2 * AROUND:
        return 0.0
    edges, highest = np.asarray(above * STEP ** np.arange(count + 1), np.float64), []
    for r in recordings:
        found = np.zeros(count, dtype=bool)
        for start, stop in stretches(r):
            part = resample(r, start, stop)
            if part.tau is not None and len(part) >= 8:
                found |= _external_lines(part, edges)
        highest.append(np.flatnonzero(found).max(initial=-1))
    there = sorted(band for band in highest if band >= 0)
    return float(np.sqrt(edges[there[-2]] * edges[there[-2] + 1])) if len(there) >= max(OFTEN * len(highest), 2) else 0.0


def share_above(recordings: Iterable[Recording], edge: float) -> float:
    """Return the share of the torque's rms at frequencies above `edge` Hz, of all joints and recordings together; 0 without a torque."""
    above = whole = 0.0
    for r in recordings:
        for part in (resample(r, start, stop) for start, stop in stretches(r)):
            for x in () if part.tau is None else part.tau.T:
                f, power = hann_power(x, float(part.t[1] - part.t[0]))
                above, whole = above + float(power[f > edge].sum()), whole + float(power.sum())
    return (above / whole) ** 0.5 if whole > 0 else 0.0


def band_of(recordings: Iterable[Recording]) -> Band:
    """Return the band of the comparison of `recordings` and of their motion."""
    known = list(recordings)
    edge, lowest, cap = known_edge(known)
    if not edge:
        return Band(cap, LOWEST_EDGE)
    motion = float(np.clip(edge, lowest, cap))
    return Band(float(np.clip(PAST * highest_line(known, motion), motion, cap)), motion)
