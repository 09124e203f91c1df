"""The time of day of the recordings: it orders them, so that slow changes can be seen."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import CampaignCheck, Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading, rows
from nnhydro.recordings.filtering.preprocessing import Preparation

AGREES = 0.05  # relative difference between the course of clock_s and of t_s
OVERLAP = 1.0  # s


@check
class ClockCourse(RecordingCheck):
    """clock_s must run with t_s."""

    id = "clock_course"
    looks_for = "a clock that runs backward or at another speed than t_s"
    remedy = "write the time of day in seconds; past midnight count on beyond 86400"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding."""
        clock, t = reading.recording.clock, reading.recording.t
        if clock is None or not np.isfinite(clock).any() or not reading.ordered:
            return
        back = np.flatnonzero(np.diff(clock) < 0)
        course, duration = float(np.nanmax(clock) - np.nanmin(clock)), reading.recording.duration
        if len(back):
            row = int(back[0]) + 1
            yield Oddity(reading.name, "warning", f"clock_s, {rows(row)}", f"runs backward at {t[row]:.4g} s", self.remedy)
        elif course > 0 and not reading.dt > 0.5 and abs(course - duration) > AGREES * duration + 1.0:
            what = f"advances by {course:.4g} s while t_s advances by {duration:.4g} s"
            yield Oddity(reading.name, "warning", "clock_s", what, self.remedy)


@check
class ClockOrder(CampaignCheck):
    """Two recordings cannot be made at the same time, and all should have a clock or none."""

    id = "clock_order"
    looks_for = "recordings that overlap in time of day, or clocks that only some recordings have"
    remedy = "correct clock_s: it orders the recordings and shows drift"

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield the first overlap, and the recordings without a clock."""
        spans, without = [], []
        for recording in campaign.recordings():
            if recording.clock is None or not np.isfinite(recording.clock).any():
                without.append(recording.name)
            else:
                spans.append((float(np.nanmin(recording.clock)), float(np.nanmax(recording.clock)), recording.name))
        spans.sort()
        clashes = [(a, b) for a, b in pairwise(spans) if b[0] < a[1] - OVERLAP]
        if clashes:
            a, b = clashes[0]
            what = f"starts at {b[0]:.6g} s, before {a[2]} ends at {a[1]:.6g} s ({len(clashes)} such pairs)"
            yield Oddity(b[2], "warning", "clock_s", what, self.remedy)
        if spans and without:
            what = f"is missing in {len(without)} of {len(campaign.names)} recordings ({', '.join(without[:3])})"
            yield Oddity(None, "note", "clock_s", what, self.remedy)
