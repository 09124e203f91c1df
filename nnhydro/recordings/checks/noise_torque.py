"""A torque that is noise from row to row, while its joint moves smoothly: a dead sensor, another column, or loads below its noise.

    B = m var(mean of m rows) / var(rows)      1 for white noise, up to m for what lasts longer        [-]
"""

from collections.abc import Iterator

import numpy as np

from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import CampaignCheck, Oddity, check
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.filtering.preprocessing import Preparation

BLOCKS = 50  # a stretch is cut into so many: B scatters by a fifth
LEAST = 5  # rows per block
WHITE = 2.0  # B: with 20 rows per block, loads that make less than 5 % of the variance
ALIKE = 0.2  # correlation of neighbouring rows
MOVED = 0.1  # rad: below it a joint may carry no load


@check
class NoiseTorque(CampaignCheck):
    """Some of a torque follows the motion."""

    id = "noise_torque"
    looks_for = "torques that are noise from row to row at joints that move"
    remedy = "is the sensor connected, and the column the right one? Else move faster, until the load exceeds the noise"

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield one finding a joint."""
        sums = np.zeros((campaign.arm.n_links, 3))  # m var(means), var(rows), covariance of neighbours, weighted by rows
        for r in campaign.recordings():
            reading = Reading.of(r, campaign.arm)
            tau = reading.recording.tau
            for start, stop in reading.stretches if tau is not None else ():
                width = (stop - start) // BLOCKS
                if tau is None or width < LEAST:
                    continue
                for joint in (int(k) for k in np.flatnonzero(reading.moved > MOVED)):
                    x = tau[start:start + BLOCKS * width, joint] - tau[start:stop, joint].mean()
                    means = x.reshape(BLOCKS, width).mean(axis=1)
                    sums[joint] += len(x) * np.array([width * means.var(), x.var(), (x[1:] * x[:-1]).mean()])
        for joint, (slow, rows, neighbours) in enumerate(sums):
            if rows > 0 and slow < WHITE * rows and abs(neighbours) < ALIKE * rows:
                what = "is noise from row to row: none of it follows the motion"
                yield Oddity(None, "warning", campaign.arm.column("tau", joint + 1), what, self.remedy)
