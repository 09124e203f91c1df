"""Hypothesis: a torque sensor has an offset."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import ANY_VALUE, InstrumentEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.sensor_view import SensorView


@effect
@final
@dataclass(frozen=True)
class TorqueBias(InstrumentEffect):
    """A constant added to one torque channel."""

    id = "torque_bias"
    family = "torque_sensor"
    name = "torque sensor offset"
    mechanism = "The sensor was not zeroed: its reading is always too high or too low by the same amount."
    equation = "reading_j = tau_j + b"
    source = ("offset o of f = C r + o, r the readings: Model Based In Situ Calibration of Six Axis Force-torque Sensors, section 5.1, "
              "https://123dok.org/document/y8g3j53w-proposed-approach-to-in-situ-calibration.html")
    signature = Signature(
        depends_on=("nothing",), parity="even", region="everywhere alike, at rest too",
        excited_by="rests, or motion in both directions",
        mistaken_for=("torque_drift", "umbilical_stiffness", "buoyancy_tilt"), zero_at_rest=False,
    )
    acts = "joint"
    standard = True
    varies = True
    stage = 4

    offset: Values = parameter("N m", 0.0, ANY_VALUE, "reading minus torque", per="arm")

    def columns(self, seen: SensorView) -> Tensor:
        """Return 1 at the joint, (n, joints, 1)."""
        return at_joint(torch.ones(len(seen.motion), 1, dtype=torch.float64), self.joint, seen.arm.n_links)

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading with the offset."""
        return seen.tau + self.change(seen)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"The torque sensor of joint {self.joint} has a constant offset of {text['offset']}."
