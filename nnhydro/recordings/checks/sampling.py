"""Sampling too slow for the motion: between two rows the angle bends.

    rms |x_k - (x_{k-1} + x_{k+1}) / 2| / std x = 1 - cos(2 pi / N)        for a sine of N rows per period
"""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.glitch import misfit
from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.checks.wrapped_angles import TURNS, wrapped_rows

ROWS_A_PERIOD = 14.0  # 1 - cos(2 pi / 14) = 0.1
MOVED = 0.05  # rad


def rows_a_period(reading: Reading, joint: int) -> float:
    """Return the rows per period of the sine that bends as much between neighbouring rows; infinite where the joint hardly moves."""
    if not reading.stretches:
        return float("inf")
    start, stop = max(reading.stretches, key=lambda span: span[1] - span[0])
    t, q = np.asarray(reading.recording.t[start:stop]), reading.recording.q[start:stop, joint]
    if np.ptp(q) < MOVED:
        return float("inf")
    bend = float(np.sqrt((misfit(t, q) ** 2).mean()) / np.std(q))
    return float(2 * np.pi / np.arccos(max(1 - bend, -1.0))) if bend > 1e-12 else float("inf")


@check
class SlowSampling(RecordingCheck):
    """There should be many rows in a period of the motion."""

    id = "slow_sampling"
    looks_for = f"motions with fewer than about {ROWS_A_PERIOD:g} rows per period"
    remedy = "accelerations are lost: log at a higher rate, or move more slowly"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a joint."""
        for joint in range(reading.arm.n_links):
            rows = rows_a_period(reading, joint)
            if rows < ROWS_A_PERIOD and not any(wrapped_rows(reading, joint, turn) for turn, _ in TURNS):
                what = f"bends between neighbouring rows as a sine with {rows:.2g} rows per period would ({1 / reading.dt:.4g} Hz)"
                yield Oddity(reading.name, "warning", reading.arm.column("q", joint + 1), what, self.remedy)
