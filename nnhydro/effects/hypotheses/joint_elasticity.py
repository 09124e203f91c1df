"""Hypothesis: a drive is compliant, so that the link is not where its encoder says."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf, pi, sqrt
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.compliance import Twist, by_joint_motion, direction, ringing_twist
from nnhydro.effects.effect import ANY_SIZE, InstrumentEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.effects.sensor_view import SensorView
from nnhydro.physics.flow import Flow

RESONANCES = (3.0, 5.0, 8.0, 13.0)  # Hz
STIFFEST = 1e-12  # rad/(N m): below, the drive is rigid


@effect
@final
@dataclass(frozen=True)
class JointElasticity(InstrumentEffect):
    """A damped torsion spring between the drive, which the encoder sees, and the link; some stiffen with the torque."""

    id = "joint_elasticity"
    family = "transmission"
    name = "compliant drive"
    mechanism = "Belt, gear or shaft yields under load: the angle of the link differs from that of the encoder."
    equation = ("q_link = q_j + delta,  J delta'' + (D + c) delta' + (S + k + k (delta/delta_2)^2) delta = -tau_j;  "
                "J, D, S = dtau_j/dqdd, dqd, dq;  c = 2 zeta sqrt(k J);  h = 1/(k^3 delta_2^2): slowly, delta = -tau_j/k + h tau_j^3")
    source = ("Spong (1987), J. Dyn. Sys. Meas. Control 109, eq. 2.9, with damping in the spring: from general knowledge, not checked; "
              "cubic spring: MathWorks, Nonlinear Rotational Spring, "
              "https://uk.mathworks.com/help/sdl/ref/nonlinearrotationalspring.html; harmonic drives are far from linear: Tuttle "
              "(1992), abstract at https://www.scribd.com/document/475775513")
    signature = Signature(
        depends_on=("tau", "qdd"), parity="odd", region="strong acceleration: the inertia seems to grow with frequency",
        excited_by="quick oscillations up to near the resonance",
        mistaken_for=("sensor_timing", "flow_memory", "backlash", "rotor_inertia"),
    )
    acts = "joint"
    stage = 1
    predictable_share = 0.5  # what rings at the resonance of link and drive hangs on how each recording began

    compliance: Values = parameter("rad/(N m)", 1e-3, ANY_SIZE, "twist per torque, 1/k", per="arm")
    damping: Values = parameter("1", 0.05, (0.0, 2.0), "damping ratio zeta of link and spring", per="arm", linear=False, grid=(0.05, 0.3))
    hardening: Values = parameter("rad/(N m)^3", 0.0, ANY_SIZE, "reduction of the twist per torque cubed, h", per="arm", absent=True)

    def narrower(self) -> tuple["JointElasticity", ...]:
        """Return the spring of one stiffness."""
        return (replace(self, hardening=()),)

    def columns(self, seen: SensorView) -> Tensor:
        """Return d reading / d (compliance, hardening), (n, joints, 2), or of the first alone."""
        tau = seen.joint_torque(seen.tau)[:, self.joint - 1]
        return torch.stack([seen.along(twist, self.joint) for twist in (-tau, *[tau**3] * len(self.hardening))], dim=-1)

    def moved_flow(self, seen: SensorView) -> tuple[Flow, Tensor | float]:
        """Return the flow of an arm whose link rings on the spring as the drive moves it; each stretch begins without ringing."""
        if self.compliance[0] <= 0:
            return seen.flow, self.change(seen)
        twist = self._twist(seen)
        return seen.flow_moved_by(*(direction(seen, x, self.joint) for x in twist)), 0.0

    def plausible(self) -> bool:
        """Return whether there is a spring: only a compliant drive can stiffen."""
        return self.compliance[0] > 0 or not any(self.hardening)

    def rough_secant(self, seen: SensorView) -> Tensor:
        """Return the columns of `secant` with the reading to first order in the twist."""
        twist = self._twist(seen)
        moved = sum((seen.by_motion(k, self.joint) * x[:, None] for k, x in enumerate(twist)), seen.tau)
        return self._secant_to(seen, moved)

    def _twist(self, seen: SensorView) -> Twist:
        """Twist, its rate and acceleration (n,) of the spring."""
        c = max(self.compliance[0], STIFFEST)
        inertia = self._inertia(seen)
        h = sum(self.hardening)
        return ringing_twist(seen, self.joint, 1 / c, 2 * self.damping[0] * sqrt(inertia / c), sqrt(c**3 / h) if h > 0 else inf)

    def extra_starts(self, seen: SensorView) -> tuple["JointElasticity", ...]:
        """Return drives whose resonance lies within the motion's band: about a rigid one the torque's curvature drowns all else there."""
        inertia = self._inertia(seen)
        if seen.motion.steady or inertia <= 0:
            return ()
        return tuple(replace(self, compliance=(1 / (inertia * (2 * pi * f) ** 2),)) for f in RESONANCES)

    def _inertia(self, seen: SensorView) -> float:
        """The median inertia that the drive's spring carries, kg m^2: before belt and gear, where the twist is."""
        if not len(seen.motion):
            return 0.0
        return float(by_joint_motion(seen, self.joint, 2).abs().median())

    def quantities(self) -> dict[str, Quantity]:
        """Return compliance and stiffness; the damping that fits best grows with the encoder's noise, and says nothing about the drive."""
        c = self.compliance[0]
        made = {"compliance": Quantity(c, "rad/(N m)"), "stiffness": Quantity(1 / max(c, STIFFEST), "N m/rad")}
        return made | ({"hardening": Quantity(self.hardening[0], "rad/(N m)^3")} if self.hardening else {})

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        stiffens = f" It stiffens: {text['hardening']} times the torque cubed is missing from the twist." if "hardening" in text else ""
        return (f"The drive of joint {self.joint} is compliant, with a stiffness of {text['stiffness']}: a soft belt, gear or "
                f"shaft.{stiffens}")
