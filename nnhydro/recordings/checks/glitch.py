"""Single rows that do not fit their neighbours: a late packet, a lost bit.

    e_k = x_k - straight line from (t_{k-1}, x_{k-1}) to (t_{k+1}, x_{k+1}) at t_k

Without a single bad row its neighbours lie on their lines; at a step or a corner they do not.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Array, Reading, quantum, rows

TIMES = 10.0  # times the typical e_k of the rows around it
QUANTA = 8.0
NEIGHBOUR = 0.4  # of e_k
AROUND = 25  # rows on either side
SHARE = 0.002  # of the channel's range
OFTEN = 0.002  # share of rows beyond which it is noise and not a glitch


def _line(ta: Array, xa: Array, tb: Array, xb: Array, t: Array) -> Array:
    result: Array = xa + (xb - xa) * (t - ta) / (tb - ta)
    return result


def alone(t: Array, x: Array, e: Array) -> NDArray[np.bool_]:
    """Return where both neighbours of row k fit well once row k is taken out."""
    left = np.abs(x[1:-3] - _line(t[:-4], x[:-4], t[3:-1], x[3:-1], t[1:-3]))
    right = np.abs(x[3:-1] - _line(t[1:-3], x[1:-3], t[4:], x[4:], t[3:-1]))
    flags = np.zeros(len(x), dtype=bool)
    flags[2:-2] = np.maximum(left, right) < NEIGHBOUR * e[2:-2]
    return flags


def misfit(t: Array, x: Array) -> Array:
    """Return e_k (n,) with its sign, 0 at the ends."""
    return np.concatenate([[0.0], x[1:-1] - _line(t[:-2], x[:-2], t[2:], x[2:], t[1:-1]), [0.0]])


def typical(e: Array) -> Array:
    """Return the 90th percentile of `e` over the rows around each row: motion and noise there."""
    from scipy.ndimage import percentile_filter

    return np.asarray(percentile_filter(e, 90, size=2 * AROUND + 1, mode="nearest"), dtype=float)


def glitches(t: Array, x: Array) -> list[int]:
    """Return the rows of `x` that jump out, each glitch once."""
    if len(x) < 2 * AROUND:
        return []
    e = np.abs(misfit(t, x))
    floor = max(QUANTA * quantum(x), SHARE * float(np.ptp(x)))
    odd = np.flatnonzero(alone(t, x, e) & (e > TIMES * typical(e)) & (e > floor))
    return [int(row) for row in odd if e[row] == e[max(row - 3, 0): row + 4].max()]


@check
class Glitch(RecordingCheck):
    """Angles do not jump for one row."""

    id = "glitch"
    looks_for = "single rows of an angle far off the line between their neighbours"
    remedy = "a late or damaged packet: leave these cells empty, or trust the low-pass if it is one in thousands"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a channel."""
        for name, x in reading.channels():
            if not name.startswith("q"):
                continue
            found = [start + row for start, stop in reading.stretches
                     for row in glitches(np.asarray(reading.recording.t[start:stop]), x[start:stop])]
            if found and len(found) <= max(3, OFTEN * len(x)):
                t = reading.recording.t[found[0]]
                more = f" and {len(found) - 1} more" if len(found) > 1 else ""
                yield Oddity(reading.name, "warning", f"{name}, {rows(found[0])}{more}", f"jumps for one row at {t:.4g} s", self.remedy)
