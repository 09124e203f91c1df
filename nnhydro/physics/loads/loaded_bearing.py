"""Friction of a bearing under load: it rolls harder the more it carries.

    tau_j = f_1,j (W/C_0)^c W d tanh(qd_j / v_0)            [N m]

    f_1, c  bearing type (self-aligning ball: about 3e-4 and 0.4)                                                     [-]
    W       equivalent radial load, weight minus buoyancy and overturning moments included                            [N]
    C_0     static capacity [N];  d  pitch diameter [m]

W is a constant of the rig here; f_1 takes up what differs from joint to joint. At the loads of a tank arm the torque is about 1e-4 N m.
(The effect load_friction is another law: friction that grows with the torque that a joint carries.)
Source: Rivera (1995), eq. 3-2-2 (print lost, restored from its symbols: Coulomb's law with the catalogue's load factor).
"""

from dataclasses import dataclass
from typing import ClassVar, final

from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.joints import SIGN_WIDTH, diagonal_columns, require_positive, smooth_sign
from nnhydro.physics.load_term import LinearTerm, Values, parameter


def load_torque(f_1: float, c: float, W: float, C_0: float, d: float) -> float:
    """Return the friction torque in N m of a bearing with pitch diameter `d` m under the load `W` N."""
    return float(f_1 * (W / C_0) ** c * W * d)


@final
@dataclass(frozen=True)
class LoadedBearing(LinearTerm):
    """Friction of bearings under a constant load, alike at all joints but for their factor f_1."""

    kind: ClassVar[str] = "loaded_bearing"
    f_1: Values = parameter("1", 3e-4, (0.0, 1.0), "load factor of the catalogue; takes up all bearings of the joint", per="joint")
    c: float = 0.4
    load_N: float = 50.0
    capacity_N: float = 2500.0
    pitch_diameter_m: float = 0.03
    v0_rad_s: float = SIGN_WIDTH

    def __post_init__(self) -> None:
        super().__post_init__()
        require_positive(self.kind, c=self.c, load_N=self.load_N, capacity_N=self.capacity_N, pitch_diameter_m=self.pitch_diameter_m,
                         v0_rad_s=self.v0_rad_s)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d f_1, (n, joints, joints)."""
        per_factor = load_torque(1.0, self.c, self.load_N, self.capacity_N, self.pitch_diameter_m)
        return diagonal_columns(per_factor * smooth_sign(flow.motion.qd, self.v0_rad_s))
