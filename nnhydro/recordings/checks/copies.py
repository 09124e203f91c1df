"""Recordings that hold the same numbers: one file twice, which says nothing of the noise."""

from collections.abc import Iterator

from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import CampaignCheck, Oddity, check
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.repeats import copied_recordings


@check
class Copies(CampaignCheck):
    """Every recording should be a run of its own."""

    id = "copies"
    looks_for = "recordings with the same times, angles and torques, digit for digit or rounded"
    remedy = "remove the copies: they count as runs of their own in every fit, and hold no information about the noise"

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield one finding a group of copies."""
        for group in copied_recordings(campaign):
            listed = ", ".join(group[:4]) + (f" and {len(group) - 4} more" if len(group) > 4 else "")
            yield Oddity(None, "warning", listed, f"{len(group)} recordings hold the same numbers: copies of one run, not repeats",
                         self.remedy)
