"""Recordings whose rows follow each other a thousand times as fast as those of others: one unit of the time mapped for all files."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import CampaignCheck, Oddity, check
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.filtering.preprocessing import Preparation

RATIOS = {1e3: "ms", 1e6: "us", 60.0: "min"}
NEAR = 0.02  # relative: rates of loggers are round numbers, and so are their ratios
FAST = 5_000.0  # Hz: torques and angles are not logged faster


@check
class MixedTimes(CampaignCheck):
    """The times of all recordings are in one unit."""

    id = "mixed_times"
    looks_for = "recordings sampled 60, 1000 or a million times as fast as others, and faster than loggers are"
    remedy = "one line of columns.yaml holds for all files: convert the times of these files instead"

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield one finding for all such recordings."""
        steps = {recording.name: Reading.of(recording, campaign.arm).dt for recording in campaign.recordings()}
        slow = max((dt for dt in steps.values() if np.isfinite(dt)), default=0.0)
        for ratio, unit in RATIOS.items():
            fast = [name for name, dt in steps.items() if dt > 0 and 1 / dt > FAST and abs(slow / dt / ratio - 1) < NEAR]
            if fast:
                listed = ", ".join(fast[:4]) + (f" and {len(fast) - 4} more" if len(fast) > 4 else "")
                what = f"rows follow each other {ratio:g} times as fast as in others: only some of the files seem to be in {unit}"
                yield Oddity(None, "warning", f"t_s, {listed}", what, self.remedy)
