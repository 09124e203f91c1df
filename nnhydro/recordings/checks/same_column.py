"""Two joints with the same numbers: one column of the log was written twice."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading


@check
class SameColumn(RecordingCheck):
    """Every joint has an angle and a torque of its own."""

    id = "same_column"
    looks_for = "two angles or two torques that agree to the last digit while they change"
    remedy = "one column of the log was taken for both: look where the other one is"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a pair of neighbouring joints."""
        for channel in ("q", "tau"):
            values = getattr(reading.recording, channel)
            for joint in range(0 if values is None else values.shape[1] - 1):
                one, two = values[:, joint], values[:, joint + 1]
                if np.array_equal(one, two, equal_nan=True) and np.isfinite(one).any() and np.nanmax(one) > np.nanmin(one):
                    names = [reading.arm.column(channel, number) for number in (joint + 1, joint + 2)]
                    yield Oddity(reading.name, "warning", ", ".join(names), "hold the same numbers", self.remedy)
