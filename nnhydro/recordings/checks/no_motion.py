"""Angles that never change in any recording, while torques do: encoders that are off, or another column."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import CampaignCheck, Oddity, check
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.filtering.preprocessing import Preparation


@check
class NoMotion(CampaignCheck):
    """Something of a campaign moves: a joint, the carriage or the water."""

    id = "no_motion"
    looks_for = "campaigns whose angles are all constant, without tow or current, while torques change"
    remedy = "are the encoders on, and the columns the right ones? Right only where waves load an arm that is held"

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield one finding for the campaign."""
        widest = 0.0
        for r in campaign.recordings():
            reading = Reading.of(r, campaign.arm)
            if reading.moved.max() > 0 or reading.towed:
                return
            tau = reading.recording.tau
            widest = max(widest, 0.0 if tau is None else float(np.nanmax(np.nanmax(tau, axis=0) - np.nanmin(tau, axis=0))))
        if widest > 0 and not campaign.steady:
            what = f"no angle changes in any recording, while torques vary by {widest:.3g} N m"
            yield Oddity(None, "warning", campaign.arm.column("q", 1), what, self.remedy)
