"""Filters with exact steps, for causes that remember.

    dy/dt = (x - y) / T        y_k = E y_{k-1} + (1 - E) (x_k + x_{k-1}) / 2,    E = exp(-dt / T)
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from nnhydro.blind_tests.truth.world import Array, Generator


def follow(x: Array, dt: float, T: float) -> Array:
    """Return `x` (n, ...) after a first-order lag of T s, starting settled at its first value."""
    keep = np.exp(-dt / max(T, 1e-6))
    middle = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1])])
    y, _ = lfilter([1 - keep], [1.0, -keep], middle, axis=0, zi=keep * x[:1])
    result: Array = y
    return result


def follow_at(x: Array, share: Array) -> Array:
    """Return `x` (n, ...) followed by the share (n, ...) of the remaining distance at each step; starts at zero."""
    y = np.zeros_like(x)
    for k in range(1, len(x)):
        y[k] = y[k - 1] + share[k] * (x[k] - y[k - 1])
    return y


def since_reversal(w: Array, dt: float) -> Array:
    """Return travel (n, ...) in m since the start or the last change of sign of `w`."""
    way = np.cumsum(np.abs(w) * dt, axis=0)
    sign = np.sign(w)
    turned = np.zeros_like(w, dtype=bool)
    turned[1:] = (sign[1:] * sign[:-1]) < 0
    origin = np.maximum.accumulate(np.where(turned, way, 0.0), axis=0)
    return way - origin


def wander(rng: Generator, t: Array, T: float) -> Array:
    """Return a smooth random function of `t` (n,) with unit deviation and a correlation time of about T s."""
    f = np.abs(rng.normal(size=24)) / (2 * np.pi * T)
    phase = rng.uniform(0, 2 * np.pi, 24)
    result: Array = np.sqrt(2 / 24) * np.cos(2 * np.pi * np.outer(t, f) + phase).sum(axis=1)
    return result
