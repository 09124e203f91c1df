"""Motions of joints and carriage on a fine grid of time, and sets of them."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from machines import Array
from scipy.ndimage import gaussian_filter1d


@dataclass
class Motion:
    """A motion on a fine grid of time; every `step`-th row is recorded."""

    t: Array
    q: Array
    dq: Array
    ddq: Array
    u0: Array
    du0: Array
    step: int
    kind: str
    hub: Array = field(default_factory=lambda: np.zeros(0))
    dhub: Array = field(default_factory=lambda: np.zeros(0))
    read_offset: Array = field(default_factory=lambda: np.zeros(0))
    clock: float = 0.0

    def __post_init__(self) -> None:
        """The hub follows the carriage unless told otherwise."""
        if not self.hub.size:
            self.hub, self.dhub = np.stack([0 * self.u0, self.u0]), np.stack([0 * self.du0, self.du0])
        if not self.read_offset.size:
            self.read_offset = np.zeros(len(self.q))

    @property
    def dt(self) -> float:
        """The step of the fine grid."""
        return float(self.t[1] - self.t[0])

    @property
    def phi(self) -> Array:
        """Absolute angles of the links."""
        return np.cumsum(self.q, axis=0)


def corners(rng: np.random.Generator, total: float, centre: float, amp: float, rate: float, rest: float) -> tuple[list[float], list[float]]:
    """Times and values of a walk between random postures, at most `rate` fast, with rests between."""
    now, value = rest, centre + amp * rng.uniform(-0.8, 0.8)
    times, values = [0.0, now], [value, value]
    while now < total:
        target = centre + amp * rng.choice([-1, 1]) * rng.uniform(0.3, 1.0)
        now += max(abs(target - value) / (rate * rng.uniform(0.4, 1.0)), 0.2)
        times.append(now)
        values.append(target)
        value, now = target, now + rest * rng.uniform(0.3, 2.0)
        times.append(now)
        values.append(value)
    return times, values


def move(rng: np.random.Generator, kind: str, n: int, seconds: float, rate_hz: float, fine_hz: float = 400.0,
         centre: tuple[float, ...] = (), amp: tuple[float, ...] = (), rate: float = 1.2, tow: float = 0.0, smooth: float = 0.06,
         base_hz: float = 0.1, rest: float = 0.6) -> Motion:
    """A motion of one kind: locked, slew, reverse, fourier; each with or without a tow of the carriage; smooth, hence differentiable.

    It starts and ends at rest.
    """
    step = max(1, round(fine_hz / rate_hz))
    dt = 1 / (rate_hz * step)
    t = np.arange(round(seconds / dt)) * dt
    middle, width = centre or (0.3,) * n, amp or (1.0,) * n
    q = np.zeros((n, t.size))
    pause = min(0.5, 0.1 * seconds)
    inner = np.clip(t - pause, 0, seconds - 2 * pause)
    fade = np.sin(np.pi / 2 * np.clip(np.minimum(t - pause, seconds - pause - t) / min(2.0, 0.25 * seconds), 0, 1)) ** 2
    for j in range(n):
        if kind == "locked":
            q[j] = middle[j] + width[j] * rng.uniform(-1, 1)
        elif kind == "slew":
            q[j] = np.interp(t, *corners(rng, seconds, middle[j], width[j], rate, rest))
        elif kind == "reverse":
            period = 4 * width[j] / (rate * rng.uniform(0.5, 1.0))
            q[j] = middle[j] + width[j] * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * inner / period + rng.uniform(0, 6)))
        elif kind == "fourier":
            for k in range(1, 6):
                a, b = rng.normal(size=2) / k**0.7
                q[j] += a * np.sin(2 * np.pi * k * base_hz * t) + b * np.cos(2 * np.pi * k * base_hz * t)
            shape = width[j] * fade * q[j] / np.abs(q[j]).max()
            q[j] = middle[j] + shape * min(1.0, 1.8 * rate / np.abs(np.gradient(shape, dt)).max())
        else:
            raise ValueError(kind)
    u0 = np.zeros_like(t)
    if tow:
        ramp = min(1.5, 0.2 * seconds)
        u0 = np.interp(t, [0, 0.08 * seconds, 0.08 * seconds + ramp, 0.9 * seconds - ramp, 0.9 * seconds], [0, 0, tow, tow, 0])
    q = gaussian_filter1d(q, smooth / dt, axis=1, mode="nearest")
    u0 = gaussian_filter1d(u0, 0.15 / dt, mode="nearest")
    dq = np.gradient(q, dt, axis=1)
    return Motion(t, q, dq, np.gradient(dq, dt, axis=1), u0, np.gradient(u0, dt), step, kind + (" tow" if tow else ""))


def tank_set(rng: np.random.Generator, rate_hz: float, seconds: float, plan: str, fine_hz: float = 400.0, tow: float = 0.8,
             rate: float = 1.4, n: int = 2, **more: Any) -> list[Motion]:
    """Recordings by letters: t locked tow, s slew, r reversals, f Fourier, S and F the same under tow, h slow moves and holds."""
    kinds = {"t": "locked", "s": "slew", "r": "reverse", "f": "fourier", "S": "slew", "F": "fourier", "h": "slew"}
    out = []
    for k, letter in enumerate(plan):
        speed = tow * rng.uniform(0.4, 1.2) * rng.choice([-1, 1]) if letter in "tSF" else 0.0
        pace = rate * (0.25 if letter == "h" else rng.uniform(0.6, 1.2))
        out.append(move(rng, kinds[letter], n, seconds * rng.uniform(0.8, 1.1), rate_hz, fine_hz, rate=pace, tow=speed,
                        rest=2.0 if letter == "h" else 0.6, **more))
        out[-1].clock = 420.0 * k
    return out
