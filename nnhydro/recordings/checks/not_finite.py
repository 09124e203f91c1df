"""Empty cells, NaN and infinities: the rows are left out, and the recording is split there."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading, rows, runs


@check
class NotFinite(RecordingCheck):
    """Every channel should hold a number in every row."""

    id = "not_finite"
    looks_for = "cells without a finite number"
    remedy = "the rows are left out and the recording is split there; record again if many are lost"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding: how many rows are lost, in which columns, and the longest place."""
        channels = (("t_s", reading.recording.t), *reading.channels())
        bad = {name: ~np.isfinite(values) for name, values in channels if not np.isfinite(values).all()}
        if not bad:
            return
        lost = np.any(list(bad.values()), axis=0)
        spans = runs(lost)
        longest = max(spans, key=lambda span: span[1] - span[0])
        more = f" in {len(spans)} places, the longest {rows(*longest)}" if len(spans) > 1 else ""
        yield Oddity(reading.name, "warning", f"{', '.join(bad)}, {rows(*spans[0])}",
                     f"{int(lost.sum())} of {len(lost)} rows hold no finite number in some column{more}", self.remedy)
