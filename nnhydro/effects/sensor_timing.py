"""Hypothesis: torques and angles are not recorded at the same time."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.effects.sensor_view import SensorView
from nnhydro.effects.time_shift import delayed, lagged

ROUGH, UNSEEN = 0.5, 0.005  # of the smear, and s: what the data may leave undecided about it


@effect
@final
@dataclass(frozen=True)
class SensorTiming(InstrumentEffect):
    """All torque channels come late by a delay and a first-order low-pass: lag = delay + T, smear = lag^2/2 + T^2/2."""

    id = "sensor_timing"
    family = "timing"
    name = "delay between torque and angle channels"
    mechanism = "Filters, buses and clocks make one channel late: the torque of a moment ago stands beside the angle of now."
    equation = "reading = low-pass(tau(t - delay); T) = tau - lag dtau/dt + smear d2tau/dt2 - ..."
    source = "Taylor's expansion of delay and first-order lag: ours"
    signature = Signature(
        depends_on=("dtau/dt",), parity="odd", region="quick changes of torque, at all joints alike, growing with frequency",
        excited_by="quick oscillations and sharp starts", mistaken_for=("flow_memory", "joint_elasticity", "encoder_offset"),
    )
    acts = "arm"
    stage = 2

    lag: Values = parameter("s", 0.0, (-1.0, 1.0), "mean time by which torques come late", per="arm")
    smear: Values = parameter("s^2", 0.0, (-1.0, 1.0), "second-order part; lag^2/2 for a pure delay", per="arm")

    def columns(self, seen: SensorView) -> Tensor:
        """Return -dtau/dt and d2tau/dt2, (n, joints, 2)."""
        return torch.stack([-seen.rate, seen.curvature], dim=-1)

    def plausible(self) -> bool:
        """Return whether a delay and a low-pass make this lag and smear; a negative lag is a delay of the angles and smears alike."""
        squared = self.lag[0] ** 2
        most = squared if self.lag[0] > 0 else squared / 2
        return squared / 2 * (1 - ROUGH) - UNSEEN**2 <= self.smear[0] <= most * (1 + ROUGH) + UNSEEN**2

    def split(self) -> tuple[float, float]:
        """Return delay and time constant T in s; a smear too small for the lag is that of a pure delay."""
        T = sqrt(max(2 * self.smear[0] - self.lag[0] ** 2, 0.0))
        return self.lag[0] - T, T

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading that comes late."""
        if seen.motion.steady:
            return seen.tau
        delay, T = self.split()
        return delayed(seen.motion.t, lagged(seen.motion.t, seen.tau, T), delay)

    def quantities(self) -> dict[str, Quantity]:
        """Return lag, delay and time constant."""
        delay, T = self.split()
        return {"lag": Quantity(self.lag[0], "s"), "delay": Quantity(delay, "s"), "low_pass": Quantity(T, "s")}

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"The torque channels come {said['lag']} later than the angles (delay {said['delay']}, low-pass {said['low_pass']})."
