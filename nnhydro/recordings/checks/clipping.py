"""Clipped channels: a sensor at the end of its range stays at one value while the true one goes on.

A plateau at the largest or smallest value counts where the channel enters and leaves it with full slope: smooth turning points and
pauses have edges that flatten, and quantised ones move by few steps.
"""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import MOVED, Array, Reading, quantum, rows, runs

FLAT = 4  # rows
EDGE = 3  # rows beside the plateau
QUANTA = 6.0  # steps of quantisation over the edge
SHARP = 0.5  # slope at the edge / slope one edge further
PLATEAUS = 2
LONG = 12  # rows: one plateau as long as this is enough


def _sharp(x: Array, start: int, direction: int, step: float) -> bool:
    """Whether the channel leaves row `start` in `direction` with full slope at once."""
    far = start + direction * 2 * EDGE
    if not 0 <= far < len(x):
        return False
    first = abs(x[start + direction * EDGE] - x[start])
    second = abs(x[far] - x[start + direction * EDGE])
    return bool(first > QUANTA * step and first > SHARP * second)


def plateaus(x: Array) -> list[tuple[int, int]]:
    """Return (start, stop) of the plateaus of `x` at its largest and smallest value that look clipped."""
    step = quantum(x)
    if step == 0.0:
        return []
    flat = [span for end in (np.nanmax(x), np.nanmin(x)) for span in runs(x == end) if span[1] - span[0] >= FLAT]
    return [(a, b) for a, b in flat if _sharp(x, a, -1, step) and _sharp(x, b - 1, 1, step)]


def clipped_plateaus(x: Array) -> list[tuple[int, int]]:
    """Return the clipped plateaus of `x` where there are enough of them to say so."""
    spans = plateaus(x)
    return spans if len(spans) >= PLATEAUS or sum(b - a for a, b in spans) >= LONG else []


def _stands_still(reading: Reading, name: str, spans: list[tuple[int, int]]) -> bool:
    """Whether the channel is an angle and a rate of its own says that the joint stood still over all of `spans`."""
    angles = {reading.arm.column("q", joint + 1): joint for joint in range(reading.arm.n_links)}
    return name in angles and reading.recording.qd is not None and all(reading.turned_by_rate(angles[name], span) < MOVED for span in spans)


@check
class Clipping(RecordingCheck):
    """Torques and angles should turn at their extremes, not stay there."""

    id = "clipped"
    looks_for = "torques or angles flat at their own largest or smallest value, several times"
    remedy = "the sensor is at the end of its range: widen it or record slower motions; leave these cells empty until then"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a channel."""
        for name, x in reading.channels():
            if not name.startswith(("q", "tau")) or "_sim" in name:
                continue
            spans = clipped_plateaus(x)
            if spans and not _stands_still(reading, name, spans):
                count = sum(b - a for a, b in spans)
                values = sorted({float(x[a]) for a, _ in spans})
                what = f"stays at exactly {' and '.join(f'{v:.6g}' for v in values)} {len(spans)} time(s), {count} rows in all"
                yield Oddity(reading.name, "warning", f"{name}, {rows(*spans[0])}", what, self.remedy)
