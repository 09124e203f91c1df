"""Hypothesis: a joint grips at low speed and lets go as it turns faster."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.dry_contact import DryContact
from nnhydro.effects.effect import ANY_SIZE, LoadEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.flow import Flow

LEAST_EXCESS = 0.2  # excess over sliding level below which the law is Coulomb's
SHARP = 8.0  # widths of the step: a grip lost below it is the step of Coulomb friction at rest, whose width nobody knows


@effect
@final
@dataclass(frozen=True)
class StribeckFriction(DryContact, LoadEffect):
    """A sliding level, and a breakaway excess that falls with speed, fast (Gauss) or slowly (Lorentz)."""

    id = "stribeck_friction"
    family = "dry_friction"
    name = "Stribeck friction"
    mechanism = "The shaft seal sticks while the joint barely moves, and releases as a film of water or grease forms."
    equation = ("tau_j = (T_C + (T_S - T_C) (1 + m (qd_j / v_S)^2)^(-1/m)) z,  dz/dt = (sign(qd_j) - z) |qd_j| / z_0,  "
                "v_0 <= 0.005 rad/s;  m = 0: exp(-(qd_j / v_S)^2);  z_0 = 0: z = tanh(qd_j / v_0)")
    source = ("m = 0: Stribeck model, m = 1: g(v) of the LuGre model with exponent 2, in J. Christopherson's collection, "
              "https://github.com/jchristopherson/friction, README.md; other m and one z_0 at all speeds (LuGre's grows with g) are "
              "ours")
    signature = Signature(
        depends_on=("qd",), parity="odd", region="|qd_j| below about twice v_S", excited_by="very slow turning with reversals",
        mistaken_for=("coulomb_friction", "load_friction", "viscous_friction", "backlash"),
    )
    acts = "joint"
    varies = True
    rate_scaled = ("speed",)
    dissipates = True

    sliding: Values = parameter("N m", 0.1, ANY_SIZE, "friction torque of fast sliding, T_C", per="arm")
    excess: Values = parameter("N m", 0.1, ANY_SIZE, "excess of the breakaway torque, T_S - T_C", per="arm")
    speed: Values = parameter("rad/s", 0.1, (1e-5, 3.0), "speed over which the grip is lost, v_S", per="arm", linear=False,
                              grid=(0.05, 0.1, 0.2, 0.4, 0.8))
    tail: Values = parameter("1", 0.0, (0.0, 1.0), "how slowly the grip is lost, m", per="arm", linear=False, grid=(0.0, 1.0),
                             absent=True)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (sliding, excess), (n, joints, 2)."""
        qd = flow.motion.qd[:, self.joint - 1]
        sign, fast, m = self.sign(flow.motion), (qd / self.speed[0]) ** 2, sum(self.tail)
        grip = torch.exp(-torch.log1p(m * fast) / m if m else -fast)
        return at_joint(torch.stack([sign, sign * grip], dim=1), self.joint, flow.arm.n_links)

    def plausible(self) -> bool:
        """Return whether it is more than Coulomb friction."""
        return self.excess[0] >= LEAST_EXCESS * self.sliding[0] and self.speed[0] >= SHARP * self.width

    def slowest(self) -> float:
        """Return twice the speed over which the grip is lost: rows of fast sliding do not determine it."""
        return 2 * self.speed[0]

    def quantities(self) -> dict[str, Quantity]:
        """Return sliding level, breakaway level and speed."""
        return {"sliding": Quantity(self.sliding[0], "N m"), "breakaway": Quantity(self.sliding[0] + self.excess[0], "N m"),
                "speed": Quantity(self.speed[0], "rad/s")} | self.bent()

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        bent = f" after {text['bending']} of rotation" if any(self.bending) else ""
        return (f"Joint {self.joint} has Stribeck friction. It breaks away at {text['breakaway']}{bent}, and slides at {text['sliding']} "
                f"above about {text['speed']}.")
