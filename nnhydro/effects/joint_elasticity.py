"""Hypothesis: a drive is compliant, so that the link is not where its encoder says."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.compliance import direction, turned_reading
from nnhydro.effects.effect import InstrumentEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.effects.sensor_view import SensorView

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
    foreseen = 0.5  # near the resonance of link and spring hardly anything: the reading is not found by iteration there

    compliance: Values = parameter("rad/(N m)", 1e-3, (0.0, 10.0), "twist per torque, 1/k", per="arm")

    def columns(self, seen: SensorView) -> Tensor:
        """Return d reading / d compliance, (n, joints, 1)."""
        twist = -seen.joint_torque(seen.tau)[:, self.joint - 1]
        return seen.along(direction(seen, twist, self.joint))[..., None]

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading behind the spring."""
        return turned_reading(seen, self.joint, lambda tau: -self.compliance[0] * tau)

    def quantities(self) -> dict[str, Quantity]:
        """Return compliance and stiffness."""
        c = self.compliance[0]
        return {"compliance": Quantity(c, "rad/(N m)"), "stiffness": Quantity(1 / max(c, STIFFEST), "N m/rad")}

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"The drive of joint {self.joint} gives way with a stiffness of {said['stiffness']}: a compliant belt, gear or shaft."
