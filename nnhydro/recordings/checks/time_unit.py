"""Time in milli-, micro- or nanoseconds: hardly an arm is sampled less than twice a second, and whoever did so can state it."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.filtering.preprocessing import SHUFFLED
from nnhydro.recordings.readers.map_line import mapping_text

SLOW = 0.5  # s: at 500 Hz, milliseconds give steps of 2; half the rate would lie below the lowest cut-off


@check
class TimeUnit(RecordingCheck):
    """t_s must be in seconds."""

    id = "time_unit"
    looks_for = "steps of time so long that the column must be in another unit"
    remedy = "map it with its unit"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield a finding where the median step of rows in order exceeds half a second and no unit of the time is stated."""
        if not (reading.dt > SLOW and (np.diff(reading.recording.t) < 0).mean() < SHUFFLED) or "t_s" in reading.recording.origin.stated:
            return
        unit, ratio = next((u, r) for u, r, top in (("ms", 1e3, 500.0), ("us", 1e6, 5e5), ("ns", 1e9, float("inf"))) if reading.dt <= top)
        yield Oddity(reading.name, "error", "t_s",
                     f"the rows are {reading.dt:.4g} s apart; in {unit} that would be {ratio / reading.dt:.4g} Hz",
                     f"{self.remedy}, {mapping_text(reading.recording.origin, 't_s', unit=unit)} (unit: s where it is right)",
                     in_file=f"convert t_s from {unit} to s in the file")
