"""Hypothesis: torque and angles are not of the same moment."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.effects.sensor_view import SensorView
from nnhydro.physics.motion import tensor

LAG = 0.05  # s, from which a search may start
MEMORY = 3.0  # time constants after which a low-pass has forgotten


@effect
@final
@dataclass(frozen=True)
class SensorTiming(InstrumentEffect):
    """All torque channels come late by a delay, a first-order low-pass, or some of both."""

    id = "sensor_timing"
    family = "timing"
    name = "delay between torque and angle channels"
    mechanism = "Filters, buses and clocks make one channel late: the torque of a moment ago is recorded with the present angle."
    equation = ("reading = low-pass(tau(t - (1 - s) lag); T = s lag) = tau - lag dtau/dt + (lag^2 + T^2)/2 d2tau/dt2 - ...;  "
                "lag < 0: the angles are late, by a delay")
    source = "Taylor's expansion of delay and first-order lag: ours"
    signature = Signature(
        depends_on=("dtau/dt",), parity="odd", region="quick changes of torque, at all joints alike, growing with frequency",
        excited_by="quick oscillations and sharp starts", mistaken_for=("flow_memory", "joint_elasticity", "encoder_offset"),
    )
    acts = "arm"
    stage = 2
    additive = True

    lag: Values = parameter("s", 0.0, (-1.0, 1.0), "mean delay of the torques", per="arm")
    low_pass: Values = parameter("1", 0.0, (0.0, 1.0), "share s of the lag that is a low-pass, the rest a delay", per="arm", linear=False,
                                 grid=(0.0, 1.0))

    def columns(self, seen: SensorView) -> Tensor:
        """Return -dtau/dt, (n, joints, 1)."""
        return -seen.rate[..., None]

    def extra_starts(self, seen: SensorView) -> tuple["SensorTiming", ...]:
        """Return a low-pass that is long against quick motions: about none the torque's slope says little of it."""
        return (replace(self, lag=(LAG,)),) if self.low_pass[0] == 1.0 and not seen.motion.steady else ()

    def split(self) -> tuple[float, float]:
        """Return delay and time constant T in s."""
        lag, T = self.lag[0], max(self.low_pass[0] * self.lag[0], 0.0)
        return lag - T, T

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading that comes late."""
        if seen.motion.steady:
            return seen.tau
        delay, T = self.split()
        return time_delay(seen.motion.t, first_order_lag(seen.motion.t, seen.tau, T), delay)

    def quantities(self) -> dict[str, Quantity]:
        """Return lag, delay and time constant."""
        delay, T = self.split()
        return {"lag": Quantity(self.lag[0], "s"), "delay": Quantity(delay, "s"), "low_pass": Quantity(T, "s")}

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"The torque channels lag the angles by {text['lag']} (delay {text['delay']}, low-pass {text['low_pass']})."


def time_delay(t: Tensor, x: Tensor, delay: float) -> Tensor:
    """Return `x` (n, k) `delay` s later (earlier where negative)."""
    from scipy.interpolate import CubicSpline

    if len(t) < 4 or delay == 0.0:
        return x
    times = t.numpy()
    return tensor(CubicSpline(times, x.numpy())(np.clip(times - delay, times[0], times[-1])))


def first_order_lag(t: Tensor, x: Tensor, lag: float) -> Tensor:
    """Return `x` (n, k) at even times `t` (n,) through a first-order low-pass with the time constant `lag` s.

    Exact for the cubic spline through x. What came before the first row is the parabola through the first rows: derivatives at a single row
    would be those of its noise.
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import lfilter

    if len(t) < 4 or not lag > 0.0:
        return x
    times, spline = t.numpy(), CubicSpline(t.numpy(), x.numpy())
    dt = (times[-1] - times[0]) / (len(times) - 1)
    d1, d2, d3 = (spline(times, order) for order in (1, 2, 3))
    d3_before = np.concatenate([d3[:1], d3[:-1]])  # the third derivative jumps at each row
    settled = x.numpy() - lag * d1 + lag**2 * d2 - lag**3 * d3
    jumps = lag**3 * (d3 - d3_before)
    first = slice(0, max(4, int(np.ceil(MEMORY * lag / dt))))
    c, b, a = np.polyfit(times[first] - times[0], x.numpy()[first], 2)
    jumps[0] = a - lag * b + 2 * lag**2 * c - settled[0]
    return tensor(settled + lfilter([1.0], [1.0, -np.exp(-dt / lag)], jumps, axis=0))
