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
    """The link sits at one side of the gap until the torque has changed sign for long enough to carry it to the other."""

    id = "backlash"
    family = "transmission"
    name = "backlash"
    mechanism = "Worn or loose gear teeth have play: when the torque changes sign the link crosses the gap and knocks on the other side."
    equation = "q_link = q_j - gap/2 s,  ds/dt = 2 tau_j / I within -1 <= s <= 1"
    source = "play that the torque crosses against grease: from general knowledge, not checked; flanks taken as rigid"
    signature = Signature(
        depends_on=("tau",), parity="odd", region="short knocks where the torque of the joint changes sign",
        excited_by="many slow changes of the sign of the torque",
        mistaken_for=("joint_elasticity", "coulomb_friction", "stribeck_friction", "sensor_timing", "flow_memory", "wake_reentry",
                      "wake_development"),
    )
    acts = "joint"
    foreseen = 0.4  # when the play is crossed hangs on the smallest torques, and the jump there is most of it
    stage = 1
    torque_scaled = ("impulse",)

    gap: Values = parameter("rad", 1e-3, (0.0, 0.5), "play of the drive, from flank to flank", per="arm")
    impulse: Values = parameter("N m s", 0.02, (1e-6, 1e4), "torque times time I that carries the link across the gap", per="arm",
                                linear=False, grid=(0.002, 0.005, 0.01, 0.02, 0.04, 0.08, 0.16, 0.3))

    def _side(self, seen: SensorView, tau: Tensor) -> Tensor:
        if seen.motion.steady or len(tau) < 2:
            return -0.5 * torch.sign(tau)
        steps = (2 / self.impulse[0] * tau * torch.diff(seen.motion.t, prepend=seen.motion.t[:1])).tolist()
        s, sides = 0.0, []
        for step in steps:
            s += step
            s = 1.0 if s > 1.0 else -1.0 if s < -1.0 else s
            sides.append(s)
        return -0.5 * torch.tensor(sides, dtype=torch.float64)

    def columns(self, seen: SensorView) -> Tensor:
        """Return d reading / d gap, (n, joints, 1)."""
        side = self._side(seen, seen.joint_torque(seen.tau)[:, self.joint - 1])
        return seen.along(direction(seen, side, self.joint))[..., None]

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading behind the gap."""
        return turned_reading(seen, self.joint, lambda tau: self.gap[0] * self._side(seen, tau))

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"The drive of joint {self.joint} has a gap of {said['gap']}; a torque that changes sign carries the link across with "
                f"{said['impulse']}.")
