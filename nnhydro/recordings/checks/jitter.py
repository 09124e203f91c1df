"""Uneven sampling: angles and torques are put on an even grid."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading

Array = NDArray[np.float64]
SEEN = 0.05  # of the median step


def jitter(reading: Reading) -> float:
    """Return the standard deviation of the steps of time within stretches, as a share of the median step; missing rows are none."""
    steps = steps_of_time(reading)
    return float(np.std(steps - lost_rows(steps))) if len(steps) else 0.0


def steps_of_time(reading: Reading) -> Array:
    """Return the steps of time (n,) within stretches, in median steps."""
    steps = [np.diff(reading.recording.t[a:b]) / reading.dt for a, b in reading.stretches]
    return np.concatenate(steps) if steps else np.zeros(0)


def lost_rows(steps: Array) -> Array:
    """Return how many rows (n,) are missing in each of the `steps` (n,), given in median steps."""
    made: Array = np.maximum(np.round(steps) - 1.0, 0.0)
    return made


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
