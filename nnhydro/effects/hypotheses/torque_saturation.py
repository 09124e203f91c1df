"""Hypothesis: a torque sensor or its amplifier clips."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.sensor_view import SensorView


@effect
@final
@dataclass(frozen=True)
class TorqueSaturation(InstrumentEffect):
    """Readings beyond a level are cut off."""

    id = "torque_saturation"
    family = "torque_sensor"
    cause = "clipping"
    name = "torque sensor clipping"
    mechanism = "The sensor, its amplifier or the motor's current is limited: a larger torque is read as the limit."
    equation = "reading_j = tau_j - c sgn(tau_j) max(|tau_j| - level, 0),  c = 1: cut off, less: compressed"
    source = ("Scilab, Saturation (clipped to a bound) and Deadband (the excess beyond it): "
              "https://docs.huihoo.com/scilab/help/2023.1.0/en_US/SATURATION.html and DEADBAND.html there; a share of the excess is "
              "ours")
    signature = Signature(
        depends_on=("tau",), parity="odd", region="the largest torques only: a flat top at one level",
        excited_by="the strongest motions", mistaken_for=("torque_gain", "reynolds_drag", "drag_form"),
    )
    acts = "joint"
    stage = 5
    predictable_share = 0.5  # the corner of a soft one is rounded over a range of levels, and the card's is sharp
    torque_scaled = ("level",)
    spread: ClassVar[Mapping[str, tuple[float, ...]]] = {"level": (0.4, 0.7)}  # a soft one bends over a range: a sum of clippings

    share: Values = parameter("1", 1.0, (0.0, 1.5), "part of the excess that is cut off", per="arm")
    level: Values = parameter("N m", 0.9, (1e-12, 1e12), "torque at which clipping begins", per="arm", linear=False,
                              grid=(1.0, 0.97, 0.94, 0.9, 0.85, 0.8))

    def columns(self, seen: SensorView) -> Tensor:
        """Return the excess beyond the level at the joint, less, (n, joints, 1)."""
        tau = seen.tau[:, self.joint - 1:self.joint]
        return at_joint(-torch.sign(tau) * (tau.abs() - self.level[0]).clamp(min=0.0), self.joint, seen.arm.n_links)

    def apply(self, seen: SensorView) -> Tensor:
        """Return the clipped reading."""
        return seen.tau + self.change(seen)

    def for_prediction(self, offset: float) -> InstrumentEffect:
        """Return the clipping with no more cut off than what exceeds its level: more would turn the reading of a larger torque back."""
        return replace(self, share=(min(self.share[0], 1.0),))

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"The torque sensor of joint {self.joint} saturates at {text['level']}: of the torque above this level, it loses "
                f"the share {text['share']}.")
