"""Hypothesis: the plane of motion is not level, and weight less buoyancy is felt."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import torch
from torch import Tensor

from nnhydro.effects.effect import ANY_VALUE, LoadEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity, polar
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.added_mass import displaced_mass
from nnhydro.recordings.arm import Arm


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
    lift: Values = parameter("1", 0.0, (0.0, 1.5), "force along Y over the weight of the water that the link displaces", per="arm",
                             absent=True)

    @classmethod
    def at_start(cls, arm: Arm, **options: Any) -> "BuoyancyTilt":
        """Return the law of any force on each link."""
        return replace(super().at_start(arm, **options), lift=())

    def narrower(self) -> tuple["BuoyancyTilt", ...]:
        """Return the law of an upright arm whose links are lifted by the water that they displace."""
        return (replace(self, force_X=(), force_Y=(), lift=(0.0,)),)

    @property
    def standard(self) -> bool:  # type: ignore[override]  # of one of its laws alone
        """Whether the law is that of buoyancy: whoever states the weight of an arm in water leaves it out."""
        return bool(self.lift)

    def acts_on(self, arm: Arm) -> bool:
        """Return whether there is a weight that buoyancy is a part of."""
        return not self.lift or (arm.gravity_m_s2 > 0 and not arm.dry)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (force_X, force_Y), (n, joints, 2 links), or d tau / d lift, (n, joints, 1)."""
        cos, sin = torch.cos(flow.phi), torch.sin(flow.phi)
        along_X, along_Y = (flow.middle_columns(across, along) for across, along in ((sin, -cos), (-cos, -sin)))  # against 1 N
        forces = [columns for values, columns in ((self.force_X, along_X), (self.force_Y, along_Y)) if values]
        weight = displaced_mass(flow) * flow.L * flow.arm.gravity_m_s2
        return torch.cat([*forces, *[(along_Y * weight).sum(-1, keepdim=True)] * len(self.lift)], dim=-1)

    def quantities(self) -> dict[str, Quantity]:
        """Return size and direction of the force on each link, and of their sum; or the lift."""
        if self.lift:
            return {"lift": Quantity(self.lift[0], "1")}
        forces = list(zip(self.force_X, self.force_Y, strict=True))
        whole = polar(sum(self.force_X), sum(self.force_Y), "N", "force")
        return whole | {f"{name}[{i}]": q for i, (x, y) in enumerate(forces, 1) for name, q in polar(x, y, "N", "force").items()}

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        if self.lift:
            return (f"Buoyancy of {text['lift']} times the weight of the displaced water lifts the links: the model has the weight in air "
                    "alone.")
        return (f"A constant force of {text['force']} pulls the arm in the direction {text['direction']} from +X: the plane is not level, "
                "or buoyancy is omitted.")
