"""How the cylinder moves: forward along +X from rest, never back.

The march of the simulation goes through equal travels, so a motion must say at what time a travel is reached.
Reversals are refused: behind a reversal the cylinder meets its own wake and the symmetric model no longer holds.
Source: McLain & Rock 1998, section 2 (constant acceleration from rest).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from nnhydro.errors import require
from nnhydro.physics.vortex_wake.potential import Real

TimeFunction = Callable[[Real], Real]


@final
@dataclass(frozen=True)
class CylinderMotion:
    """A forward motion from rest, as functions of time."""

    name: str
    travel: TimeFunction  # s(t), m
    speed: TimeFunction  # U(t), m/s
    acceleration: TimeFunction  # dU/dt, m/s^2
    time_at: TimeFunction  # t(s), s
    farthest: float = np.inf  # m, travel up to which the motion is known


def constant_acceleration(acceleration: float) -> CylinderMotion:
    """Give the motion U = a t; acceleration a in m/s^2, positive.

    Raises ConfigError for an acceleration that is not positive. Source: McLain & Rock 1998, section 2.
    """
    return power_start(acceleration, 1.0)


def power_start(rate: float, exponent: float) -> CylinderMotion:
    """Give the motion U = rate * t^exponent: 0 an impulsive start, 1 constant acceleration.

        s = rate t^(n+1) / (n+1),   (D/U^2) dU/dt = n/(n+1) D/s

    rate m/s^(1+exponent), positive; exponent n >= 0. All members are self-similar: their coefficients depend on s/D alone.
    Raises ConfigError outside these ranges. Source: ours.
    """
    require(np.isfinite(rate) and rate > 0, f"rate of the start is {rate}: it must be positive (the motion goes along +X)")
    require(np.isfinite(exponent) and exponent >= 0, f"exponent of the start is {exponent}: it must be 0 (impulsive) or more")
    n = exponent
    return CylinderMotion(
        name=f"U = {rate:g} t^{exponent:g}",
        travel=lambda t: rate * t ** (n + 1) / (n + 1),
        speed=lambda t: rate * t**n,
        acceleration=lambda t: n * rate * t ** (n - 1) if n > 0 else np.zeros_like(t),
        time_at=lambda s: ((n + 1) * s / rate) ** (1 / (n + 1)),
    )


def sampled_motion(t: ArrayLike, U: ArrayLike) -> CylinderMotion:
    """Give the motion through samples of the speed, by monotone cubic interpolation.

    t (n,) s, strictly increasing, starting at the moment of rest or of the impulsive start; U (n,) m/s, positive after t[0].
    Raises ConfigError for fewer than 4 samples, uneven lengths, times that do not increase, or a speed that returns to 0 or reverses.
    Source: ours.
    """
    time, speed = np.asarray(t, dtype=np.float64), np.asarray(U, dtype=np.float64)
    require(time.ndim == 1 and time.shape == speed.shape and time.size >= 4, "t and U must be 1-D, equally long, 4 samples or more")
    require(bool(np.all(np.diff(time) > 0)), "t must increase strictly: sort the samples and drop repeated times")
    require(
        bool(np.isfinite(speed).all() and speed[0] >= 0 and (speed[1:] > 0).all()),
        "U must stay positive after the start: the symmetric wake model does not hold through a stop or a reversal; cut the run there",
    )
    time = time - time[0]
    U_of_t = PchipInterpolator(time, speed)
    travel, acceleration = U_of_t.antiderivative(), U_of_t.derivative()

    def time_at(s: Real) -> Real:
        """Return when the travel is `s`."""
        low, high = np.zeros_like(s), np.full_like(s, time[-1])
        for _ in range(60):  # bisection: U may vanish at the start, where Newton's step would not exist
            middle = 0.5 * (low + high)
            short = travel(middle) < s
            low, high = np.where(short, middle, low), np.where(short, high, middle)
        return np.asarray(0.5 * (low + high))

    return CylinderMotion("sampled", travel, U_of_t, acceleration, time_at, farthest=float(travel(time[-1])))
