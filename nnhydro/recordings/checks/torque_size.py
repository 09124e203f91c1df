"""Torques far smaller than any drive's."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import CampaignCheck, Oddity, check
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.readers.map_line import mapping_text

SMALLEST = 1e-6  # N m: a milligram's weight at ten centimetres


@check
class TinyTorque(CampaignCheck):
    """Some torque of the campaign should be one that a drive can feel."""

    id = "tiny_torque"
    looks_for = "torques of a campaign that are all far below what any drive exerts"
    remedy = "is the unit right? Map it with its unit, and scale it once only"

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield one finding where every torque is tiny, though not every one is zero."""
        largest = [float(np.nanmax(np.abs(recording.tau))) for recording in campaign.recordings()
                   if recording.tau is not None and np.isfinite(recording.tau).any()]
        if largest and 0 < max(largest) < SMALLEST:
            name = campaign.arm.column("tau", 1)
            yield Oddity(None, "warning", name, f"no torque of the campaign exceeds {max(largest):.2g} N m", "is the unit right? Map it, "
                         f"e.g. {mapping_text(campaign.load(campaign.names[0]).origin, name, unit='N cm')}, and scale it once only")
