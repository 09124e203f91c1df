"""Time that repeats or runs backward: two logs in one file, or a clock that was set."""

from collections.abc import Iterator

import numpy as np

from nnhydro.errors import count_text
from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading, rows
from nnhydro.recordings.filtering.preprocessing import order_remedy


@check
class TimeOrder(RecordingCheck):
    """t_s must increase from row to row."""

    id = "time_order"
    looks_for = "rows whose time is not later than that of the row before"
    remedy = "split the file, drop the rows, or sort them by t_s"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding where time repeats, one where it runs backward."""
        t = reading.recording.t
        steps = np.diff(t)
        for kind, wrong in (("repeats", np.flatnonzero(steps == 0)), ("runs backward", np.flatnonzero(steps < 0))):
            if len(wrong):
                row = int(wrong[0]) + 1
                yield Oddity(reading.name, "error", f"t_s, {rows(row)}", f"time {kind} ({t[row - 1]:.6g} s, then {t[row]:.6g} s; "
                             f"{count_text(len(wrong), 'such row')})", order_remedy(steps))
