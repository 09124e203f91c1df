"""Coulomb friction: a constant torque against the rotation of a joint.

    tau_j = T_C,j tanh(qd_j / v_0)                          [N m]

    T_C,j  level of joint j                                                                                           [N m]
    qd_j   rate of joint j, relative to the link inboard of it                                                        [rad/s]
    v_0    rate over which the sign turns (an option: smooth, so that integrators and gradients pass through rest)    [rad/s]

Holds for dry or lightly lubricated contacts in steady sliding; with locked joints the true torque is anywhere between -T_C and T_C.
Source: Rivera (1995), section 3.2 (friction opposes rotation, eq. 3-2-4; one aggregate law a joint after Dupont 1993).
"""

from dataclasses import dataclass
from typing import ClassVar, final

from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.joints import SIGN_WIDTH, own_joint, require_positive, smooth_sign
from nnhydro.physics.load_term import LinearTerm, Values, parameter


@final
@dataclass(frozen=True)
class CoulombTerm(LinearTerm):
    """Constant friction with one level a joint."""

    kind: ClassVar[str] = "coulomb_friction"
    level: Values = parameter("N m", 0.05, (0.0, 1e3), "friction torque while the joint turns", per="joint")
    v0_rad_s: float = SIGN_WIDTH

    def __post_init__(self) -> None:
        super().__post_init__()
        require_positive(self.kind, v0_rad_s=self.v0_rad_s)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d level, (n, joints, joints)."""
        return own_joint(smooth_sign(flow.motion.qd, self.v0_rad_s))
