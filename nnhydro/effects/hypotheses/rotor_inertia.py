"""Hypothesis: the inertia of a motor or gear is missing."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.effect import ANY_SIZE, LoadEffect, Signature, Values, effect, of_joint, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.rotor_inertia import RotorTerm


@effect
@final
@dataclass(frozen=True)
class RotorInertia(LoadEffect):
    """Inertia on one drive's own acceleration."""

    id = "rotor_inertia"
    family = "inertia"
    name = "rotor inertia"
    mechanism = "Rotor and gear turn many times faster than the joint; their inertia counts with the square of the ratio."
    equation = "tau_j = J psidd_j,  psi_j the angle of drive j (q_j where it is driven directly)"
    source = ("Drake (Robot Locomotion Group), Reflected Inertia, J = ratio^2 J_rotor (there after Featherstone, 2008): "
              "https://github.com/RobotLocomotion/drake, multibody/tree/joint_actuator.h")
    signature = Signature(
        depends_on=("qdd",), parity="odd", region="strong acceleration of that joint relative to its neighbour",
        excited_by="accelerating that joint while the others hold or move against it",
        mistaken_for=("added_mass", "payload_mass", "joint_elasticity", "sensor_timing"),
    )
    acts = "joint"
    standard = True

    inertia: Values = parameter("kg m^2", 0.05, ANY_SIZE, "inertia as felt at the joint", per="arm")

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d inertia, (n, joints, 1)."""
        return of_joint(RotorTerm(self.inertia).columns(flow), self.joint)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"The rotor and gear of joint {self.joint} add an inertia of {text['inertia']} at the joint."
