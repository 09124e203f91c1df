"""Some rows of what a low-pass leaves of many columns: what `Segment.seen` gives, without filtering the rows that nobody asks for.

The zero-phase filter is a weighted mean over neighbours; its weights are its answer to an impulse, cut off where they have died away.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
PERIODS = 6.0  # of the cut-off: beyond them the weights are below 1e-6 of the largest
BLOCK = 64  # rows wanted at a time


@lru_cache(maxsize=64)
def _weights(low_pass: LowPass, dt: float) -> Array:
    """Weights (2 half + 1,) of the neighbours."""
    half = int(np.ceil(PERIODS / (low_pass.cutoff_hz * dt)))
    impulse = np.zeros((8 * half + 1, 1))
    impulse[4 * half] = 1.0
    return low_pass.apply(impulse, dt)[3 * half:5 * half + 1, 0]


def reach(segment: Segment) -> int:
    """Return how many rows on either side of a row the filter of `segment` looks at."""
    if segment.low_pass is None or segment.low_pass.cutoff_hz * segment.dt >= 0.45:
        return 0
    return len(_weights(segment.low_pass, round(segment.dt, 12))) // 2


def filtered_rows(segment: Segment, columns: Array, rows: NDArray[np.int64]) -> Array:
    """Return the rows (m,), ascending, of the filtered `columns` (n, ...); as they are where the segment is not filtered."""
    half = reach(segment)
    if segment.low_pass is None or not half:
        return columns[rows]
    h, flat = _weights(segment.low_pass, round(segment.dt, 12)), columns.reshape(len(columns), -1)
    found = np.empty((len(rows), flat.shape[1]))
    for start in range(0, len(rows), BLOCK):
        wanted = rows[start:start + BLOCK]
        first, last = int(wanted[0]) - half, int(wanted[-1]) + half + 1
        places = np.arange(first, last)
        offset = places - wanted[:, None] + half
        weight = np.where((offset >= 0) & (offset < len(h)), h[np.clip(offset, 0, len(h) - 1)], 0.0)
        found[start:start + BLOCK] = weight @ flat[np.clip(places, 0, len(flat) - 1)]
    return found.reshape(len(rows), *columns.shape[1:])
