"""Hypothesis: a torque sensor has the wrong scale."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.sensor_view import SensorView


@effect
@final
@dataclass(frozen=True)
class TorqueGain(InstrumentEffect):
    """One torque channel multiplied by a constant."""

    id = "torque_gain"
    family = "torque_sensor"
    cause = "scale"
    name = "torque sensor scale"
    mechanism = "The sensor's calibration factor is off: every reading is too large or too small by the same factor."
    equation = "reading_j = (1 + g) tau_j"
    source = ("calibration matrix C of f = C r + o, r the readings, which may change when the sensor is mounted: Model Based In Situ "
              "Calibration of Six Axis Force-torque Sensors, section 5.1, "
              "https://123dok.org/document/y8g3j53w-proposed-approach-to-in-situ-calibration.html")
    signature = Signature(
        depends_on=("tau",), parity="odd", region="in proportion to the torque, in every part of it: inertia too",
        excited_by="torques of known size: the dry arm's inertia or weight",
        mistaken_for=("torque_crosstalk", "load_friction", "torque_saturation"),
    )
    acts = "joint"
    stage = 3
    additive = True

    error: Values = parameter("1", 0.0, (-0.6, 0.6), "scale less 1", per="arm")

    def columns(self, seen: SensorView) -> Tensor:
        """Return tau_j at the joint, (n, joints, 1)."""
        return at_joint(seen.tau[:, self.joint - 1:self.joint], self.joint, seen.arm.n_links)

    def apply(self, seen: SensorView) -> Tensor:
        """Return the scaled reading."""
        return seen.tau + self.change(seen)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"The torque sensor of joint {self.joint} has a scale error of {text['error']}: it reads (1 + scale error) times the torque."
