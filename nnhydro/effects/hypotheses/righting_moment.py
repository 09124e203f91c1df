"""Hypothesis: a floating hull rights itself by another law than that of a weight."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import ANY_VALUE, LoadEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.recordings.arm import Arm


@effect
@final
@dataclass(frozen=True)
class RightingMoment(LoadEffect):
    """What the righting moment of a hull has beside that of a weight at the centre of mass: it stiffens or softens with the heel."""

    id = "righting_moment"
    family = "restoring"
    name = "righting moment of a hull"
    mechanism = "A hull that heels dips another part of itself: its metacentric height changes with the heel, that of a weight does not."
    equation = "tau_j = C_3 x^3 + C_5 x^5,  x = q_j + pi/2, 0 where the weight hangs;  the weight in arm.yaml has the linear part"
    source = ("Ibrahim & Grace (2010), Modeling of ship roll dynamics, Math. Probl. Eng. 934714, https://studylib.net/doc/10948374: "
              "restoring moments at large roll (its abstract); the odd polynomial: not checked")
    signature = Signature(
        depends_on=("q",), parity="mixed", region="at large heel, in every recording alike; the period of the roll changes with its size",
        excited_by="free decays from a large heel", mistaken_for=("umbilical_stiffness", "torque_ripple", "buoyancy_tilt"),
        zero_at_rest=False,
    )
    acts = "joint"
    needs_water = True
    driven = False

    cubic: Values = parameter("N m/rad^3", 0.0, ANY_VALUE, "how much more it rights than the weight, C_3", per="arm")
    quintic: Values = parameter("N m/rad^5", 0.0, ANY_VALUE, "the same at the largest heel, C_5", per="arm", absent=True)

    @classmethod
    def places(cls, arm: Arm) -> tuple[int, ...]:
        """Return the joints about which a body can roll: none of a linear axis."""
        return () if arm.sliding else super().places(arm)

    def narrower(self) -> tuple["RightingMoment", ...]:
        """Return the cubic law alone."""
        return (replace(self, quintic=()),)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (cubic, quintic), (n, joints, 2), or of the first alone."""
        x = torch.remainder(flow.motion.q[:, self.joint - 1] - pi / 2, 2 * pi) - pi
        return at_joint(torch.stack([x**3, *[x**5] * len(self.quintic)], dim=1), self.joint, flow.arm.n_links)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        grows = "softens" if self.cubic[0] < 0 else "stiffens"
        return (f"The righting moment of the hull about joint {self.joint} {grows} with the heel: by {text['cubic']} times the cube of the "
                "angle.")
