"""Tow with locked joints: the carriage is ramped up to speed, held there and ramped down.

Source: Rivera (1995), section 4.2 (stage 1: locked joints, 0.3 to 1.25 m/s).
"""

from typing import Literal, final

import numpy as np
from pydantic import Field

from nnhydro.simulation.motions.motion_kind import Array, Setting, TimedMotion, Way
from nnhydro.simulation.recipe.per_joint import PerJoint, one_each


@final
class Tow(TimedMotion):
    """Joints locked at `q_rad` while the carriage runs; `hold_s` at full speed, `rest_s` lengthens that."""

    kind: Literal["tow"] = "tow"
    q_rad: PerJoint
    hold_s: float = Field(gt=0, le=3600)
    rest_s: float = Field(default=0.0, ge=0, le=600)

    def path(self, setting: Setting) -> Way:
        """Return the duration that the carriage needs, s, and the constant angles."""
        locked = one_each(self.q_rad, setting.arm.n_links, self.key("q_rad"))
        ramps = 2 * (self.carriage.start_s + self.carriage.ramp_s) if self.carriage.ramp_s > 0 and self.carriage.u0_m_s != 0 else 0.0

        def joints(t: Array) -> tuple[Array, Array, Array]:
            still = np.zeros((len(t), len(locked)))
            return still + locked, still, still

        return Way(self.hold_s + ramps, joints)
