"""Hypothesis: a drive's torque ripples with its angle."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot, pi
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import ANY_VALUE, LoadEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.flow import Flow


@effect
@final
@dataclass(frozen=True)
class TorqueRipple(LoadEffect):
    """A sine of the joint's angle with a whole number of periods a turn."""

    id = "torque_ripple"
    family = "transmission"
    cause = "ripple"
    name = "torque ripple"
    mechanism = "Gear teeth, a harmonic drive or magnets pass by as the joint turns: the same small torque recurs at every tooth."
    equation = "tau_j = a cos(N q_j) + b sin(N q_j)"
    source = ("Malzahn & Roozing (2016), Compliant Joint Toolbox, ripple of type 1: https://github.com/geez0x1/CompliantJointToolbox, "
              "model/nonlinear/torque_ripple.m; gear teeth as its cause: abstract of doi 10.1109/19.728840, "
              "https://explore.openaire.eu/search/publication?pid=10.1109%2F19.728840")
    signature = Signature(
        depends_on=("q",), parity="mixed", region="everywhere: a comb over the joint's angle, a hum whose pitch follows its speed",
        excited_by="slow turning over the whole range of the joint", mistaken_for=("vortex_shedding", "buoyancy_tilt", "coulomb_friction"),
        zero_at_rest=False,
    )
    acts = "joint"

    cosine: Values = parameter("N m", 0.0, ANY_VALUE, "amplitude in phase with the angle", per="arm")
    sine: Values = parameter("N m", 0.0, ANY_VALUE, "amplitude a quarter period later", per="arm")
    periods: Values = parameter("1", 12.0, (1.0, 1000.0), "periods per turn, N", per="arm", linear=False,
                                grid=(*map(float, range(4, 60)), *map(float, range(60, 124, 4))))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (cosine, sine), (n, joints, 2)."""
        angle = self.periods[0] * flow.motion.q[:, self.joint - 1]
        return at_joint(torch.stack([torch.cos(angle), torch.sin(angle)], dim=1), self.joint, flow.arm.n_links)

    def narrowest(self) -> float:
        """Return two periods: what does not come again may be a spring, or the righting moment of a hull."""
        return 2 * 2 * pi / self.periods[0]

    def quantities(self) -> dict[str, Quantity]:
        """Return amplitude and number of periods."""
        return {"amplitude": Quantity(hypot(self.cosine[0], self.sine[0]), "N m", length=True), "periods": Quantity(self.periods[0], "1")}

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"Joint {self.joint} has a torque ripple of {text['amplitude']}, {text['periods']} times per turn: gear teeth or magnets."
