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
        """Yield one finding a column."""
        for name, values in (("t_s", reading.recording.t), *reading.channels()):
            bad = ~np.isfinite(values)
            if bad.any():
                spans = runs(bad)
                longest = max(spans, key=lambda span: span[1] - span[0])
                more = f" in {len(spans)} places, the longest" if len(spans) > 1 else ""
                yield Oddity(reading.name, "warning", f"{name}, {rows(*spans[0])}",
                             f"{int(bad.sum())} of {len(values)} cells hold no finite number{more}{f' {rows(*longest)}' if more else ''}",
                             self.remedy)
