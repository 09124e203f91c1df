"""Uneven sampling: angles and torques are put on an even grid."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading

SEEN = 0.05  # of the median step


def jitter(reading: Reading) -> float:
    """Return the standard deviation of the steps of time within stretches, as a share of the median step."""
    steps = [np.diff(reading.recording.t[a:b]) for a, b in reading.stretches]
    return float(np.std(np.concatenate(steps)) / reading.dt) if steps else 0.0


@check
class Jitter(RecordingCheck):
    """Steps of time should be equal."""

    id = "jitter"
    looks_for = f"steps of time that scatter by more than {SEEN:.0%} of the median"
    remedy = "rows are put on an even grid; log the time stamp of the sensor, not that of arrival, if accelerations look noisy"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield a note where the steps scatter."""
        share = jitter(reading)
        if share > SEEN:
            yield Oddity(reading.name, "note", "t_s", f"the steps of time scatter by {share:.0%} of the median step", self.remedy)
