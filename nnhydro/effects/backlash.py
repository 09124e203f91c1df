"""Hypothesis: there is a gap in a drive."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.compliance import direction, turned_reading
from nnhydro.effects.effect import InstrumentEffect, Signature, Values, effect, parameter
from nnhydro.effects.sensor_view import SensorView


@effect
@final
@dataclass(frozen=True)
class Backlash(InstrumentEffect):
    """The link sits at one side of the gap or the other, as the torque says, and crosses while the torque passes zero."""

    id = "backlash"
    family = "transmission"
    name = "backlash"
    mechanism = "Worn or loose gear teeth have play: when the torque changes sign the link crosses the gap and knocks on the other side."
    equation = "q_link = q_j - gap/2 tanh(tau_j / T_m)"
    source = "play with compliant flanks: from general knowledge, not checked; the smooth form is ours"
    signature = Signature(
        depends_on=("tau",), parity="odd", region="short knocks where the torque of the joint changes sign",
        excited_by="many slow changes of the sign of the torque",
        mistaken_for=("joint_elasticity", "coulomb_friction", "stribeck_friction"),
    )
    acts = "joint"
    stage = 1
    torque_scaled = ("meshing",)

    gap: Values = parameter("rad", 1e-3, (0.0, 0.5), "play of the drive, from flank to flank", per="arm")
    meshing: Values = parameter("N m", 0.1, (1e-4, 1e4), "torque T_m at which the flanks have met", per="arm", linear=False,
                                grid=(0.01, 0.03, 0.1, 0.3))

    def _side(self, tau: Tensor) -> Tensor:
        return -0.5 * torch.tanh(tau / self.meshing[0])

    def columns(self, seen: SensorView) -> Tensor:
        """Return d reading / d gap, (n, joints, 1)."""
        side = self._side(seen.joint_torque(seen.tau)[:, self.joint - 1])
        return seen.along(direction(seen, side, self.joint))[..., None]

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading behind the gap."""
        return turned_reading(seen, self.joint, lambda tau: self.gap[0] * self._side(tau))

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"The drive of joint {self.joint} has a gap of {said['gap']}, crossed as its torque changes sign (within {said['meshing']})."
