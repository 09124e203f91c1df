"""Torques far smaller than any drive's, and a belt whose outer angle may be meant from elsewhere."""

from collections.abc import Iterator

import numpy as np

from nnhydro.conventions import column
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import ArmCheck, CampaignCheck, Oddity, check
from nnhydro.recordings.preprocessing import Preparation

SMALLEST = 1e-6  # N m: a tenth of a milligram at ten centimetres


@check
class TinyTorque(CampaignCheck):
    """Some torque of the campaign should be one that a drive can feel."""

    id = "tiny_torque"
    looks_for = "torques of a campaign that are all far below what any drive exerts"
    remedy = "is the unit right? Map it, e.g. 'tau1_Nm: {from: tau1_Nm, unit: N cm}' in columns.yaml or --map FILE, and scale it once only"

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield one finding where every torque is tiny, though not every one is zero."""
        largest = [float(np.nanmax(np.abs(r.tau))) for r in campaign.recordings() if r.tau is not None and np.isfinite(r.tau).any()]
        if largest and 0 < max(largest) < SMALLEST:
            name = column("tau", 1)
            yield Oddity(None, "warning", name, f"no torque of the campaign exceeds {max(largest):.2g} N m", self.remedy)


@check
class BeltAngle(ArmCheck):
    """A belt's outer angle is often read at the motor, where it is absolute."""

    id = "belt_angle"
    looks_for = "arms driven by a belt whose q2 is taken relative to link 1"
    remedy = "right where the sensor sits at the elbow; where it sits on the motor at the base, write 'angle2: absolute' under drive"

    def find(self, arm: Arm) -> Iterator[Oddity]:
        """Yield a note where the drive is remote and the angle is not said to be absolute."""
        if arm.drive.kind == "remote" and arm.drive.angle2 == "relative":
            yield Oddity(None, "note", "arm.yaml drive", f"{column('q', 2)} is read as the angle between the links", self.remedy)
