"""Hypothesis: a joint drags in proportion to its speed."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.effect import ANY_SIZE, LoadEffect, Signature, Values, effect, of_joint, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.viscous_friction import ViscousTerm


@effect
@final
@dataclass(frozen=True)
class ViscousFriction(LoadEffect):
    """Friction proportional to speed at one joint."""

    id = "viscous_friction"
    family = "viscous"
    name = "viscous friction"
    mechanism = "Grease, a fluid film or the damping of the motor resists the joint in proportion to its speed."
    equation = "tau_j = b qd_j"
    source = "Rivera (1995), section 3.2: one aggregate friction law a joint"
    signature = Signature(
        depends_on=("qd",), parity="odd", region="fast turning of that joint",
        excited_by="turning at several speeds while the links rest in the flow",
        mistaken_for=("coulomb_friction", "reynolds_drag", "drag_form", "flow_memory"),
    )
    acts = "joint"
    standard = True
    varies = True
    dissipates = True

    coefficient: Values = parameter("N m s/rad", 0.05, ANY_SIZE, "friction torque per unit joint rate", per="arm")

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d coefficient, (n, joints, 1)."""
        return of_joint(ViscousTerm(self.coefficient).columns(flow), self.joint)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"Joint {self.joint} has viscous friction of {text['coefficient']}, proportional to its speed."
