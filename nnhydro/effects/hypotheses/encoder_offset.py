"""Hypothesis: an angle is read with a constant error."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect, Signature, Values, effect, parameter
from nnhydro.effects.sensor_view import SensorView
from nnhydro.physics.flow import Flow


@effect
@final
@dataclass(frozen=True)
class EncoderOffset(InstrumentEffect):
    """The zero of one encoder is off."""

    id = "encoder_offset"
    family = "angle_sensor"
    name = "encoder offset"
    mechanism = "The encoder's zero was set at the wrong angle: the model puts the arm at a slightly wrong angle."
    equation = "reading = tau(q_j - delta, ...),  delta = angle read less true angle"
    source = ("Ferguson, robot_calibration: joint angle offsets among what a calibration seeks, "
              "https://docs.ros.org/en/kinetic/api/robot_calibration/html/")
    signature = Signature(
        depends_on=("q", "dtau/dq"), parity="even", region="where the torque depends on the angle: towing, bent arms, gravity",
        excited_by="tows at many angles, on both sides of the tow", mistaken_for=("buoyancy_tilt", "ambient_current", "torque_bias"),
    )
    acts = "joint"
    stage = 0
    additive = True

    offset: Values = parameter("rad", 0.0, (-1.6, 1.6), "angle read less true angle, delta", per="arm")

    def columns(self, seen: SensorView) -> Tensor:
        """Return -d tau / d q_j, (n, joints, 1)."""
        return -seen.by_motion(0, self.joint)[..., None]

    def moved_flow(self, seen: SensorView) -> tuple[Flow, float]:
        """Return the flow at the true angles."""
        dq = torch.zeros_like(seen.motion.q)
        dq[:, self.joint - 1] = -self.offset[0]
        return seen.flow_moved_by(dq), 0.0

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"The encoder of joint {self.joint} has a constant offset of {text['offset']}."
