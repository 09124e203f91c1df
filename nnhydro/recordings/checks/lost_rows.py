"""Single rows that a logger lost: steps of time that are whole multiples of the usual one."""

from collections.abc import Iterator

from nnhydro.recordings.checks.jitter import SEEN, jitter, lost_rows, steps_of_time
from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading


@check
class LostRows(RecordingCheck):
    """No row should be missing between two others."""

    id = "lost_rows"
    looks_for = "steps of time of two and more median steps, where the others are even"
    remedy = "the motion is interpolated there; nothing needs to be done for a few, look for lost packets if there are many"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one note for all missing rows of a recording; where steps scatter, none can be counted."""
        missing = int(lost_rows(steps_of_time(reading)).sum())
        if missing and jitter(reading) <= SEEN:
            share = missing / (len(reading.recording) + missing)
            yield Oddity(reading.name, "note", "t_s", f"{missing} single row(s) missing, {share:.1%} of all", self.remedy)
