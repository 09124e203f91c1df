"""A last cell that lost its digits, as where a logger was switched off within a row: -0.5321 became -0."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Array, Reading, rows

DIGITS = 3  # decimals fewer than the rows before: chance does that once in a thousand rows
BEFORE = 50  # rows that tell how many decimals and how large a step are usual
TIMES, TIMES_MINUS = 5.0, 1.5  # the largest step from row to row before: below it the value may be right; after a bare minus


def decimals(x: float) -> int:
    """Return the decimals that the number `x` needs, 9 at the most."""
    return len(f"{x:.9f}".rstrip("0").partition(".")[2])


def cut_cell(x: Array) -> bool:
    """Return whether the last value of `x` (n,) lost its decimals and jumps."""
    before = x[-BEFORE - 1:-1]
    if len(before) < BEFORE or not np.isfinite(x[-BEFORE - 1:]).all():
        return False
    if decimals(float(x[-1])) > np.median([decimals(float(value)) for value in before]) - DIGITS:
        return False
    minus = x[-1] == 0 and bool(np.signbit(x[-1]))
    return bool(abs(x[-1] - x[-2]) > (TIMES_MINUS if minus else TIMES) * np.abs(np.diff(before)).max())


@check
class CutOff(RecordingCheck):
    """The last row is whole."""

    id = "cut_off"
    looks_for = "a last cell with fewer digits than all before it, off their course"
    remedy = "the log was cut off within this row: remove the row"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a channel."""
        for name, x in reading.channels():
            if cut_cell(x):
                what = f"ends with {x[-1]:g}, which lost its digits"
                yield Oddity(reading.name, "warning", f"{name}, {rows(len(x) - 1)}", what, self.remedy)
