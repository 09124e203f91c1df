"""Friction of a lubricated ball bearing without load: its oil is sheared.

    T   = f_0 d^3 (nu n)^(2/3) 1e-7      for nu n >= 2000   [N mm]
    T   = f_0 d^3 160e-7                 below              [N mm]
    tau_j = T(|qd_j|) tanh(qd_j / v_0)

    f_0  bearing type (catalogue: 1.5 to 2 deep groove or self-aligning with oil mist or grease, up to 12)            [-]
    d    pitch diameter [mm];  nu  kinematic viscosity of the lubricant [cSt = mm^2/s];  n  speed [rpm]

Arm joints (10 rpm, 30 cSt: nu n = 300) are in the lower branch, where the torque is constant. The step between the branches is 0.8 %.
Source: Rivera (1995), eq. 3-2-1 ("Petroff law" after Dimarogonas 1989; exponent lost in print); constants and branches: Palmgren's form.
"""

from dataclasses import dataclass
from math import pi
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.joints import SIGN_WIDTH, diagonal_columns, require_positive, smooth_sign
from nnhydro.physics.load_term import LinearTerm, Values, parameter

LOW = 2000.0  # cSt rpm: below it the film no longer thins with speed


def petroff_torque(f_0: float, d: float, viscosity: float, n: Tensor) -> Tensor:
    """Return f_0 d^3 (viscosity n)^(2/3), the printed law, in whatever consistent units the arguments have."""
    return f_0 * d**3 * (viscosity * n) ** (2 / 3)


def bearing_torque(f_0: float, d_mm: float, nu_cSt: float, n_rpm: Tensor) -> Tensor:
    """Return the friction torque in N m of an unloaded bearing turning at `n_rpm` >= 0."""
    low = torch.full_like(n_rpm, 160.0 * f_0 * d_mm**3)
    high = petroff_torque(f_0, d_mm, nu_cSt, n_rpm.clamp(min=LOW / nu_cSt))  # clamped: the slope at rest stays finite
    return 1e-10 * torch.where(nu_cSt * n_rpm < LOW, low, high)


@final
@dataclass(frozen=True)
class BearingFriction(LinearTerm):
    """Friction of unloaded bearings, alike at all joints but for their factor f_0."""

    kind: ClassVar[str] = "bearing_friction"
    f_0: Values = parameter("1", 2.0, (0.0, 1e3), "bearing factor of the catalogue; takes up all bearings of the joint", per="joint")
    pitch_diameter_m: float = 0.03
    viscosity_m2_s: float = 30e-6
    v0_rad_s: float = SIGN_WIDTH

    def __post_init__(self) -> None:
        super().__post_init__()
        require_positive(self.kind, pitch_diameter_m=self.pitch_diameter_m, viscosity_m2_s=self.viscosity_m2_s, v0_rad_s=self.v0_rad_s)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d f_0, (n, joints, joints)."""
        qd = flow.motion.qd
        rpm = qd.abs() * 60 / (2 * pi)
        torque = bearing_torque(1.0, 1e3 * self.pitch_diameter_m, 1e6 * self.viscosity_m2_s, rpm)
        return diagonal_columns(torque * smooth_sign(qd, self.v0_rad_s))
