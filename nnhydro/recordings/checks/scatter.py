"""Repeats of one motion whose torques differ by more than the sensor's noise: the load itself is random."""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import CampaignCheck, Oddity, check
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.repeats import expected_noise, independent, repeated_recordings, scatter

TIMES = 4.0  # times what the noise within the recordings explains
SHARE = 0.15  # of the torque's rms
RANDOM = 0.6  # of the torque's rms: as often one sign as the other


@check
class Scatter(CampaignCheck):
    """Repeats should agree within the sensor's noise."""

    id = "repeats_scatter"
    looks_for = "repeats of one motion whose torques differ far more than the sensor's noise explains"
    remedy = "report the scatter, do not fit it: no model of the motion alone can be better"

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield one finding a group of repeats and joint."""
        for group in independent(campaign, repeated_recordings(campaign)):
            found = scatter(campaign, group, how)
            if found is None:
                continue
            noise = np.sqrt(np.mean([expected_noise(campaign.load(name), how) ** 2 for name in group], axis=0))
            for joint in range(campaign.arm.n_links):
                std, rms = float(found.std[joint]), float(found.rms[joint])
                if std > TIMES * noise[joint] and std > SHARE * rms:
                    kind = "random, even in sign" if std > RANDOM * rms else "not repeatable"
                    yield Oddity(None, "warning", f"{campaign.arm.column('tau', joint + 1)}, {', '.join(group[:4])}",
                                 f"{len(group)} repeats of one motion differ by {std:.2g} N m ({std / max(rms, 1e-300):.0%} of the torque, "
                                 f"{std / max(noise[joint], 1e-300):.0f} times the sensor's noise): the load is {kind}", self.remedy)
