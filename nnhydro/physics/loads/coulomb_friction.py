"""Coulomb friction: a constant torque against the rotation of a joint.

    tau_j = T_C,j z_j,   z_j = tanh(qd_j / v_0);  where the contact bends: dz_j/dt = (sign(qd_j) - z_j) |qd_j| / z_0       [N m]

    T_C,j  level of joint j                                                                                           [N m]
    qd_j   rate of joint j, relative to the link inboard of it                                                        [rad/s]
    v_0    rate over which the sign turns (an option: smooth, so that integrators and gradients pass through rest)    [rad/s]
    z_0    rotation over which the contact bends before it slips (an option; presliding)                              [rad]

Holds for dry or lightly lubricated contacts in steady sliding; with locked joints the true torque is anywhere between -T_C and T_C.
Source: Rivera (1995), section 3.2 (friction opposes rotation, eq. 3-2-4; one aggregate law a joint after Dupont 1993); presliding: dz/dt of
LuGre's model at a level that no speed changes (known as Dahl's: not checked), https://github.com/jchristopherson/friction, README.md.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.joints import SIGN_WIDTH, bent_sign, diagonal_columns, require_bending, require_positive
from nnhydro.physics.load_term import ANY_SIZE, LinearTerm, Values, parameter
from nnhydro.physics.motion import Motion


@final
@dataclass(frozen=True)
class CoulombTerm(LinearTerm):
    """Constant friction with one level a joint, whose contacts may bend like a spring before they slip."""

    kind: ClassVar[str] = "coulomb_friction"
    level: Values = parameter("N m", 0.05, ANY_SIZE, "friction torque while the joint turns", per="joint")
    v0_rad_s: float = SIGN_WIDTH
    bending_rad: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_positive(self.kind, v0_rad_s=self.v0_rad_s)
        require_bending(self.kind, (self.bending_rad,))

    def sign(self, motion: Motion, joint: int) -> Tensor:
        """Return d tau / d level at `joint` (from 1), (n,): the sign of its rate, smooth or with presliding."""
        return bent_sign(motion, joint, self.bending_rad, self.v0_rad_s)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d level, (n, joints, joints)."""
        return diagonal_columns(torch.stack([self.sign(flow.motion, joint) for joint in range(1, flow.arm.n_links + 1)], dim=1))
