"""Hypothesis: a torque sensor also feels the other joint's torque."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.sensor_view import SensorView


@effect
@final
@dataclass(frozen=True)
class TorqueCrosstalk(InstrumentEffect):
    """A share of each other joint's torque in the reading of one."""

    id = "torque_crosstalk"
    family = "torque_sensor"
    cause = "crosstalk"
    name = "torque crosstalk"
    mechanism = "The load of its neighbour twists the sensor, or the cables share a ground: one channel leaks into the other."
    equation = "reading_j = tau_j + sum_k c_k tau_k,  k the other joints"
    source = ("Schrand (HITEC), Cross Talk Compensation Using Matrix Methods, "
              "https://hitec.humaneticsgroup.com/perspectives/cross-talk-compensation-using-matrix-methods")
    signature = Signature(
        depends_on=("tau of the other joint",), parity="odd", region="in proportion to the other joint's torque",
        excited_by="loading one joint while the other carries little", mistaken_for=("torque_gain", "payload_mass", "added_mass"),
    )
    acts = "joint"
    stage = 3
    additive = True
    fewest_links = 2

    leak: Values = parameter("1", 0.0, (-0.5, 0.5), "share of the other joint's torque", per="other joint")

    def columns(self, seen: SensorView) -> Tensor:
        """Return the others' torques at the joint, (n, joints, joints - 1)."""
        others = [k for k in range(seen.arm.n_links) if k != self.joint - 1]
        return at_joint(seen.tau[:, others], self.joint, seen.arm.n_links)

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading with the leak."""
        return seen.tau + self.change(seen)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"The torque sensor of joint {self.joint} has crosstalk: it also reads {', '.join(text.values())} times the torque of the "
                "other joint.")
