"""Hypothesis: a drive is compliant, so that the link is not where its encoder says."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import final

from torch import Tensor

from nnhydro.effects.compliance import nearly_turned_reading, turned_reading
from nnhydro.effects.effect import InstrumentEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.effects.sensor_view import SensorView
from nnhydro.physics.motion import tensor
from nnhydro.recordings.filtering.low_pass import LowPass

BELOW, ORDER = 0.9, 4  # of the resonance: where the low-pass ends, and how steeply
RESONANCES = (3.0, 5.0, 8.0, 13.0)  # Hz
STIFFEST = 1e-12  # rad/(N m): below, the drive is rigid


@effect
@final
@dataclass(frozen=True)
class JointElasticity(InstrumentEffect):
    """A torsion spring between the drive, which the encoder sees, and the link."""

    id = "joint_elasticity"
    family = "transmission"
    name = "compliant drive"
    mechanism = "Belt, gear or shaft give way under load: the link lags behind the encoder, and is not where that says."
    equation = "q_link = q_j - tau_j/k; to first order tau - (dtau/dq + dtau/dqd d/dt + dtau/dqdd d2/dt2) tau_j/k"
    source = "linear spring in series: from general knowledge, not checked"
    signature = Signature(
        depends_on=("tau", "qdd"), parity="odd", region="strong acceleration: the inertia seems to grow with frequency",
        excited_by="quick oscillations up to near the resonance",
        mistaken_for=("sensor_timing", "flow_memory", "backlash", "rotor_inertia"),
    )
    acts = "joint"
    stage = 1
    predictable_share = 0.5  # what rings at the resonance of link and drive hangs on how each recording began

    compliance: Values = parameter("rad/(N m)", 1e-3, (0.0, 10.0), "twist per torque, 1/k", per="arm")

    def columns(self, seen: SensorView) -> Tensor:
        """Return d reading / d compliance, (n, joints, 1)."""
        twist = -seen.joint_torque(seen.tau)[:, self.joint - 1]
        return seen.along(twist, self.joint)[..., None]

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading behind the spring, which twists by what lies below the resonance of link and drive.

            tau = tau_rigid / (1 - G(f) f^2/f_0^2),   f_0 = sqrt(k/J) / (2 pi),   J = median |d tau_j / d qdd_j|, tau at the joint

        G is a low-pass at 0.9 f_0: above the resonance the iteration would diverge.
        """
        return turned_reading(seen, self.joint, self._twist(seen))

    def rough_secant(self, seen: SensorView) -> Tensor:
        """Return the columns of `secant` with the reading to first order in the twist."""
        return self._secant_to(seen, nearly_turned_reading(seen, self.joint, self._twist(seen)))

    def _twist(self, seen: SensorView) -> Callable[[Tensor], Tensor]:
        """The twist (n,) rad of the spring under a torque (n,) N m."""
        m, c, inertia = seen.motion, self.compliance[0], self._inertia(seen)
        if m.steady or len(m) < 4 or c * inertia <= 0:
            return lambda tau: -c * tau
        dt, below = float(m.t[-1] - m.t[0]) / (len(m) - 1), LowPass(BELOW / (2 * pi * sqrt(c * inertia)), ORDER)
        return lambda tau: -c * tensor(below.apply(tau.numpy(), dt))

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
        at, reading = self.joint - 1, seen.tau
        change = seen.joint_torque(reading + seen.by_motion(2, self.joint)) - seen.joint_torque(reading)
        return float(change[:, at].abs().median())

    def quantities(self) -> dict[str, Quantity]:
        """Return compliance and stiffness."""
        c = self.compliance[0]
        return {"compliance": Quantity(c, "rad/(N m)"), "stiffness": Quantity(1 / max(c, STIFFEST), "N m/rad")}

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"The drive of joint {self.joint} is compliant, with a stiffness of {said['stiffness']}: a soft belt, gear or shaft."
