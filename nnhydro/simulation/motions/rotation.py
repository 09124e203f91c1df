"""Rotation at constant rate: ramped up from rest, held, ramped down to rest.

Source: Rivera (1995), section 4.2 ("steady translations and rotations"); ramps: ours.
"""

from typing import Literal, final

from pydantic import Field

from nnhydro.simulation.motions.motion_kind import Array, Setting, TimedMotion, Way
from nnhydro.simulation.motions.profiles import RampProfile, ramp_profile
from nnhydro.simulation.recipe.per_joint import PerJoint, one_each


@final
class Rotation(TimedMotion):
    """Joints turn from `q_rad` at the rates `dq_rad_s` for `hold_s`, with ramps of `ramp_s` at both ends."""

    kind: Literal["rotation"] = "rotation"
    q_rad: PerJoint
    dq_rad_s: PerJoint
    hold_s: float = Field(ge=0, le=3600)
    ramp_s: float = Field(default=0.5, gt=0, le=600)
    profile: RampProfile = "minimum_jerk"

    def path(self, setting: Setting) -> Way:
        """Return the time under way, s, and the path."""
        joints = setting.arm.n_links
        start, rate = one_each(self.q_rad, joints, self.key("q_rad")), one_each(self.dq_rad_s, joints, self.key("dq_rad_s"))

        def path(t: Array) -> tuple[Array, Array, Array]:
            way, speed, acceleration = ramp_profile(self.profile, t, self.ramp_s, self.hold_s)
            return start + way[:, None] * rate, speed[:, None] * rate, acceleration[:, None] * rate

        return Way(2 * self.ramp_s + self.hold_s, path)
