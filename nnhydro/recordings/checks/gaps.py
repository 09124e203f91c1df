"""Gaps: the recording is split there, nothing is filled in."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading, rows
from nnhydro.recordings.filtering.preprocessing import GAP


@check
class Gaps(RecordingCheck):
    """Rows should follow each other at about the same step."""

    id = "gaps"
    looks_for = f"steps of time longer than {GAP:g} median steps"
    remedy = ("the recording is split there, the ends are not compared; nothing needs to be done, "
              "look for lost packets before the next run")

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding for all gaps of a recording."""
        steps = np.diff(reading.recording.t)
        wide = np.flatnonzero(steps > GAP * reading.dt)
        if len(wide):
            worst = int(wide[np.argmax(steps[wide])])
            yield Oddity(reading.name, "note", f"t_s, {rows(worst + 1)}", f"{len(wide)} gap(s), the longest {steps[worst]:.3g} s at "
                         f"{reading.recording.t[worst]:.4g} s (the median step is {reading.dt:.3g} s)", self.remedy)
