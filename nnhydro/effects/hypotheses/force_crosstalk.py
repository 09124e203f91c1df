"""Hypothesis: the torque sensor at the hub also feels the force that pulls along the first link."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.sensor_view import SensorView


@effect
@final
@dataclass(frozen=True)
class ForceCrosstalk(InstrumentEffect):
    """A lever times the force along the first link in the reading of its joint; it does not change sign when the motion is reversed."""

    id = "force_crosstalk"
    family = "torque_sensor"
    cause = "force_crosstalk"
    name = "force crosstalk"
    mechanism = ("A torque sensor that is mounted off its axis, or at an angle, also reads the force on it: while the arm turns, the pull "
                 "that holds it on its circle.")
    equation = "reading_1 = tau_1 + e F.e_1,  F: force that the hub supplies, e_1: along link 1"
    source = ("Schrand (HITEC), Cross Talk Compensation Using Matrix Methods, "
              "https://hitec.humaneticsgroup.com/perspectives/cross-talk-compensation-using-matrix-methods")
    signature = Signature(
        depends_on=("qd", "q", "u0"), parity="even", region="fast turning, in both directions alike",
        excited_by="turning at several speeds, forwards and backwards",
        mistaken_for=("viscous_friction", "ambient_current", "torque_bias", "torque_crosstalk"),
    )
    acts = "arm"
    stage = 3
    additive = True

    lever: Values = parameter("m", 0.0, (-1.0, 1.0), "e, distance at which the force acts on the sensor", per="arm")

    def columns(self, seen: SensorView) -> Tensor:
        """Return the force along link 1 at its joint, (n, joints, 1) N; 0 where the hub's force is not known."""
        if seen.hub_force_of is None or seen.arm.sliding:
            return torch.zeros(*seen.motion.q.shape, 1, dtype=torch.float64)
        force = seen.memo.of((type(self), "force"), lambda: seen.hub_force_of(seen.flow))  # type: ignore[misc]
        heading = seen.flow.phi[:, :1]
        along = force[:, :1] * torch.cos(heading) + force[:, 1:2] * torch.sin(heading)
        return at_joint(along, 1, seen.arm.n_links)

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading with what the force adds."""
        return seen.tau + self.change(seen)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"The torque sensor of joint 1 has crosstalk: it also reads {text['lever']} times the force along link 1."
