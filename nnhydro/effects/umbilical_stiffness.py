"""Hypothesis: a hose or cable pulls a joint back."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.flow import Flow

FURTHEST = 2 * pi  # rad: a rest angle beyond a turn is no hose's but that of a constant torque


@effect
@final
@dataclass(frozen=True)
class UmbilicalStiffness(LoadEffect):
    """A linear spring at one joint with a rest angle of its own."""

    id = "umbilical_stiffness"
    family = "restoring"
    name = "hose or cable stiffness"
    mechanism = "A hose, cable or boot across the joint bends with it and pulls it back towards the angle at which it lies slack."
    equation = "tau_j = k (q_j - q_rest)"
    source = "linear spring: from general knowledge, not checked"
    signature = Signature(
        depends_on=("q",), parity="mixed", region="grows with the distance from the rest angle, in every recording alike",
        excited_by="holding the joint at both ends of its range", mistaken_for=("torque_bias", "torque_drift", "buoyancy_tilt"),
        zero_at_rest=False,
    )
    acts = "joint"

    stiffness: Values = parameter("N m/rad", 0.5, (0.0, 1e4), "spring constant", per="arm")
    preload: Values = parameter("N m", 0.0, (-1e4, 1e4), "torque at q = 0: -stiffness times rest angle", per="arm")

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (stiffness, preload), (n, joints, 2)."""
        q = flow.motion.q[:, self.joint - 1]
        return at_joint(torch.stack([q, torch.ones_like(q)], dim=1), self.joint, flow.arm.n_links)

    def plausible(self) -> bool:
        """Return whether the rest angle is one that a hose could have."""
        return abs(self.preload[0]) <= FURTHEST * self.stiffness[0]

    def quantities(self) -> dict[str, Quantity]:
        """Return stiffness and rest angle."""
        k = self.stiffness[0]
        return {"stiffness": Quantity(k, "N m/rad"), "rest_angle": Quantity(-self.preload[0] / k if k else 0.0, "rad")}

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"Joint {self.joint} is pulled back towards {said['rest_angle']} by {said['stiffness']}: a hose or cable."
