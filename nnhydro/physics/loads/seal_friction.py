"""Friction of a lip seal: its lips are pressed on the turning shaft.

    tau_j = z 2 pi f_s,j R_L R_s^2 tanh(qd_j / v_0)         [N m]

    z    lips (the rig has a double-lip seal)               [-]
    f_s  friction coefficient of lip and shaft, 0.5 for polished steel                                                [-]
    R_L  interference load per metre of circumference       [N/m]
    R_s  radius of the shaft                                [m]

Independent of the radial load and nearly of speed; 0.02 to 0.08 N m a seal, which is a third of the elbow's torque in a slow tow.
Source: Rivera (1995), eq. 3-2-3 (print lost, restored from its symbols; the 0.08 of R_L is taken as N/mm, 80 N/m).
"""

from dataclasses import dataclass
from math import pi
from typing import ClassVar, final

from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.joints import SIGN_WIDTH, diagonal_columns, require_positive, smooth_sign
from nnhydro.physics.load_term import LinearTerm, Values, parameter


def seal_torque(f_s: float, R_L: float, R_s: float, lips: float) -> float:
    """Return the friction torque in N m of a seal with `lips` lips, pressed with `R_L` N/m on a shaft of radius `R_s` m."""
    return float(lips * 2 * pi * f_s * R_L * R_s**2)


@final
@dataclass(frozen=True)
class SealFriction(LinearTerm):
    """Friction of shaft seals, alike at all joints but for their coefficient f_s."""

    kind: ClassVar[str] = "seal_friction"
    f_s: Values = parameter("1", 0.5, (0.0, 1e2), "friction coefficient of lip and shaft", per="joint")
    lip_load_N_per_m: float = 80.0
    shaft_radius_m: float = 0.01
    lips: int = 2
    v0_rad_s: float = SIGN_WIDTH

    def __post_init__(self) -> None:
        super().__post_init__()
        require_positive(self.kind, lip_load_N_per_m=self.lip_load_N_per_m, shaft_radius_m=self.shaft_radius_m, lips=self.lips,
                         v0_rad_s=self.v0_rad_s)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d f_s, (n, joints, joints)."""
        per_coefficient = seal_torque(1.0, self.lip_load_N_per_m, self.shaft_radius_m, self.lips)
        return diagonal_columns(per_coefficient * smooth_sign(flow.motion.qd, self.v0_rad_s))
