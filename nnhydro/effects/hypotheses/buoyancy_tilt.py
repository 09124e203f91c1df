"""Hypothesis: the plane of motion is not level, and weight less buoyancy is felt."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import ANY_VALUE, LoadEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity, polar
from nnhydro.physics.flow import Flow


@effect
@final
@dataclass(frozen=True)
class BuoyancyTilt(LoadEffect):
    """A constant force on every link, at its middle, in the plane of motion."""

    id = "buoyancy_tilt"
    family = "restoring"
    name = "weight and buoyancy in a tilted plane"
    mechanism = "If the plane is not level, each link tends to swing to its lowest point, or to its highest if it floats."
    equation = "tau_j = -sum_i P_ji x F_i,  F_i = (m_i - rho V_i) g (sin of the tilt along X, along Y)"
    source = "Rivera (1995), section 3.3: weight drops out only where the plane is horizontal"
    signature = Signature(
        depends_on=("q",), parity="mixed", region="everywhere, at rest too; a sine of the absolute angle of each link",
        excited_by="holding many postures at rest", mistaken_for=("umbilical_stiffness", "torque_bias", "payload_mass", "encoder_offset"),
        zero_at_rest=False,
    )
    acts = "arm"

    force_X: Values = parameter("N", 0.0, ANY_VALUE, "force on the link along X, taken at its middle")
    force_Y: Values = parameter("N", 0.0, ANY_VALUE, "force on the link along Y, taken at its middle")

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (force_X, force_Y), (n, joints, 2 links)."""
        cos, sin = torch.cos(flow.phi), torch.sin(flow.phi)
        directions = ((sin, -cos), (-cos, -sin))  # what the drive supplies across and along the link against 1 N along X, along Y
        return torch.cat([flow.middle_columns(across, along) for across, along in directions], dim=-1)

    def quantities(self) -> dict[str, Quantity]:
        """Return size and direction of the force on each link, and of their sum."""
        forces = list(zip(self.force_X, self.force_Y, strict=True))
        whole = polar(sum(self.force_X), sum(self.force_Y), "N", "force")
        return whole | {f"{name}[{i}]": q for i, (x, y) in enumerate(forces, 1) for name, q in polar(x, y, "N", "force").items()}

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"A constant force of {text['force']} pulls the arm in the direction {text['direction']} from +X: the plane is not level, "
                "or buoyancy is omitted.")
