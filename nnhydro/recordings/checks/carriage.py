"""A carriage speed that is given but always 0."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading


@check
class CarriageAtRest(RecordingCheck):
    """u0_m_s, where it is given, should move."""

    id = "carriage_at_rest"
    looks_for = "a column u0_m_s that is 0 in every row"
    remedy = "right for runs without tow; otherwise look for the carriage's log"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield a note."""
        u0 = reading.recording.u0
        if u0 is not None and not np.nanmax(np.abs(u0), initial=0.0) > 0:
            yield Oddity(reading.name, "note", "u0_m_s", "is 0 throughout", self.remedy)
