"""A belt whose outer angle may be meant from elsewhere."""

from collections.abc import Iterator

from nnhydro.conventions import column
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.checks.oddity import ArmCheck, Oddity, check


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
