"""Shapes in time: how a slew gets from rest to rest, and how a speed is ramped up, held and ramped down.

    slew    q = q_a + (q_b - q_a) sigma(s),  s = t / T in [0, 1]
    ramp    v = V [r(t) - r(t - ramp - hold)],  r rising from 0 to 1 within `ramp` seconds

    bang_bang      constant acceleration and deceleration; peak acceleration 4 |q_b - q_a| / T^2
    trapezoid      a share c of the time to speed up, as much to slow down; peak |q_b - q_a| / (c (1 - c) T^2)
    minimum_jerk   sigma = 10 s^3 - 15 s^4 + 6 s^5; peak (10 / sqrt 3) |q_b - q_a| / T^2

Source: McLain & Rock (1998), section 4 (constant acceleration, fifth-order splines); ramps: ours.
"""

from math import sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SlewProfile = Literal["bang_bang", "trapezoid", "minimum_jerk"]
RampProfile = Literal["trapezoid", "minimum_jerk"]


def _trapezoid(s: Array, c: float) -> tuple[Array, Array, Array]:
    """sigma and its derivatives in s for the ramp share `c`, 0 < c <= 1/2."""
    v = 1.0 / (1.0 - c)
    first, last = s < c, s > 1.0 - c
    share = np.where(first, v * s**2 / (2 * c), np.where(last, 1.0 - v * (1.0 - s) ** 2 / (2 * c), v * (s - c / 2)))
    rate = np.where(first, v * s / c, np.where(last, v * (1.0 - s) / c, v))
    # with c = 1/2 the middle has no length: the half-way sample belongs to the deceleration
    last = last | (s >= 1.0 - c) if c == 0.5 else last
    return share, rate, np.where(first, v / c, np.where(last, -v / c, 0.0))


def slew_shape(profile: SlewProfile, s: Array, c: float) -> tuple[Array, Array, Array]:
    """Return sigma(s) and its first and second derivative in s, each of the shape of `s`; at rest outside 0 <= s < 1."""
    inside = (s >= 0.0) & (s < 1.0)
    x = np.clip(s, 0.0, 1.0)
    if profile == "minimum_jerk":
        share, rate, bend = x**3 * (10 - 15 * x + 6 * x**2), 30 * x**2 * (1 - x) ** 2, 60 * x * (1 - x) * (1 - 2 * x)
    else:
        share, rate, bend = _trapezoid(x, 0.5 if profile == "bang_bang" else c)
    return share, np.where(inside, rate, 0.0), np.where(inside, bend, 0.0)


def peak_acceleration(profile: SlewProfile, c: float) -> float:
    """Return the largest |sigma''| of a slew: peak acceleration times T^2 over the way."""
    return {"minimum_jerk": 10.0 / sqrt(3.0), "bang_bang": 4.0, "trapezoid": 1.0 / (c * (1.0 - c))}[profile]


def _rise(profile: RampProfile, t: Array, ramp: float) -> tuple[Array, Array, Array]:
    """Integral, value and derivative of a step from 0 to 1 that takes from t = 0 to t = ramp."""
    s = np.clip(t / ramp, 0.0, 1.0)
    inside = (t >= 0.0) & (t < ramp)
    after = np.maximum(t - ramp, 0.0)
    if profile == "minimum_jerk":
        integral, value, slope = s**4 * (2.5 - 3 * s + s**2), s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2
    else:
        integral, value, slope = s**2 / 2, s, np.ones_like(s)
    return ramp * integral + after, value, np.where(inside, slope / ramp, 0.0)


def ramp_profile(profile: RampProfile, t: Array, ramp: float, hold: float) -> tuple[Array, Array, Array]:
    """Return way, speed and acceleration of a unit speed that is ramped up from t = 0, held and ramped down; `ramp` > 0 s."""
    up, down = _rise(profile, t, ramp), _rise(profile, t - ramp - hold, ramp)
    return up[0] - down[0], up[1] - down[1], up[2] - down[2]
