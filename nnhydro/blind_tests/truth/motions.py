"""Commands of the concealed campaigns: slews, Fourier sums, slow reversals, folded postures, with and without tow.

Everything starts from rest in still water. Slews are fifth-order polynomials or constant accelerations with ramps of 60 ms between them,
which is what servos make of a bang-bang command. Source: motions as in Rivera (1995, section 4.2) and McLain & Rock (1998, section 4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nnhydro.blind_tests.truth.world import Array, Generator, TrueRun

RAMP = 0.06  # s, from one constant acceleration to the next
FASTEST = 2.6  # rad/s


@dataclass(frozen=True)
class Plan:
    """One recording to be: kind of joint motion, tow speed in m/s, posture, length in s, and the seed of its command."""

    kind: str  # bang, jerk, fourier, slow
    speed: float
    folded: bool
    seconds: float
    seed: int
    swell: bool = False  # the carriage's speed varies


def smooth(s: Array) -> tuple[Array, Array, Array]:
    """Return 10 s^3 - 15 s^4 + 6 s^5 on 0..1 (0 before, 1 after) and its two derivatives."""
    s = s.clip(0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2, 60 * s * (1 - s) * (1 - 2 * s)


def bang(t: Array, T: float) -> tuple[Array, Array, Array]:
    """Return a unit step of constant acceleration and deceleration within T s, with its two derivatives."""
    corners = np.array([0.0, RAMP, T / 2 - RAMP / 2, T / 2 + RAMP / 2, T - RAMP, T])
    fine = np.linspace(0.0, T, 4001)
    a = np.interp(fine, corners, [0.0, 1.0, 1.0, -1.0, -1.0, 0.0])
    h = fine[1]
    v = np.concatenate([[0.0], np.cumsum(0.5 * h * (a[1:] + a[:-1]))])
    p = np.concatenate([[0.0], np.cumsum(h * v[:-1] + h**2 * (2 * a[:-1] + a[1:]) / 6)])
    inside = t.clip(0.0, T)
    q, qd, qdd = (np.interp(inside, fine, y) / p[-1] for y in (p, v, a))
    return q, qd, qdd


def _tour(t: Array, rng: Generator, kind: str, low: float, high: float) -> tuple[Array, Array, Array]:
    """Return angle, rate, acceleration (n,) of slews between random angles in low..high, with rests between them."""
    here = rng.uniform(low, high)
    q, qd, qdd = np.full(len(t), here), np.zeros(len(t)), np.zeros(len(t))
    start = rng.uniform(0.2, 0.7)
    while start < t[-1] - 0.8:
        goal = rng.uniform(low, high)
        step = goal - here
        T = max(0.6, 1.9 * abs(step) / rng.uniform(0.9, FASTEST))
        if kind == "bang":
            p, v, a = bang(t - start, T)
        else:
            p, v, a = smooth((t - start) / T)
            v, a = v / T, a / T**2
        q, qd, qdd, here = q + step * p, qd + step * v, qdd + step * a, goal
        start += T + (rng.uniform(0.3, 0.9) if rng.random() < 0.6 else 0.0)
    return q, qd, qdd


def _fourier(t: Array, rng: Generator, low: float, high: float, slow: bool) -> tuple[Array, Array, Array]:
    """Return a sum of sines faded in over 1.2 s, within low..high and FASTEST (slow: a quarter of that)."""
    top = 0.35 if slow else 1.1
    f = rng.uniform(0.12, top, 5)
    c, phase = rng.normal(size=5) / (1 + 2 * f), rng.uniform(0, 2 * np.pi, 5)
    angle = 2 * np.pi * np.outer(t, f) + phase
    omega = 2 * np.pi * f
    g, dg, ddg = np.sin(angle) @ c, np.cos(angle) @ (c * omega), -np.sin(angle) @ (c * omega**2)
    size = min(0.5 * (high - low) / np.abs(g).max(), FASTEST * (0.25 if slow else 1.0) / np.abs(dg).max())
    p, v, a = smooth(t / 1.2)
    v, a = v / 1.2, a / 1.2**2
    middle = rng.uniform(low, high) if slow else 0.5 * (low + high)
    return middle + size * p * g, size * (p * dg + v * g), size * (p * ddg + 2 * v * dg + a * g)


def _carriage(t: Array, plan: Plan, rng: Generator) -> tuple[Array, Array]:
    """Return u0 and du0: from rest to the tow speed in a second, then constant or swelling."""
    p, v, _ = smooth((t - 0.3) / 1.0)
    u0, du0 = plan.speed * p, plan.speed * v
    if plan.swell:
        f, depth = rng.uniform(0.2, 0.5), rng.uniform(0.2, 0.5)
        wave, rate = 1 + depth * np.sin(2 * np.pi * f * t), depth * 2 * np.pi * f * np.cos(2 * np.pi * f * t)
        u0, du0 = u0 * wave, du0 * wave + u0 * rate
    return u0, du0


def ranges(links: int, folded: bool, side: float) -> list[tuple[float, float]]:
    """Return lowest and highest angle of each joint in rad; folded: link 2 lies back along link 1."""
    elbow = (2.0, 2.75) if folded else (-2.1, 2.1)
    low, high = sorted((side * elbow[0], side * elbow[1]))
    return [(-1.4, 1.4), *[(low, high)] * (links - 1)]


def carry_out(plan: Plan, links: int, rate: float, name: str, start: float, seed: int) -> TrueRun:
    """Return the run that `plan` commands, on a grid of `rate` Hz."""
    rng = np.random.default_rng([7001, plan.seed])
    t = np.arange(round(plan.seconds * rate)) / rate
    columns = []
    for low, high in ranges(links, plan.folded, rng.choice([-1.0, 1.0])):
        if plan.kind in ("bang", "jerk"):
            columns.append(_tour(t, rng, plan.kind, low, high))
        else:
            columns.append(_fourier(t, rng, low, high, plan.kind == "slow"))
    q, qd, qdd = (np.column_stack([column[k] for column in columns]) for k in range(3))
    return TrueRun(name, t, q, qd, qdd, *_carriage(t, plan, rng), start, seed)


def plans(rng: Generator, links: int, count: int, seconds: tuple[float, float]) -> list[Plan]:
    """Return `count` plans: the eight that every campaign has, then a random choice; the last one or two repeat earlier ones."""
    def plan(kind: str, towed: bool, folded: bool = False, swell: bool = False) -> Plan:
        speed = float(rng.uniform(0.2, 0.9)) if towed else 0.0
        return Plan(kind, speed, folded and links > 1, round(float(rng.uniform(*seconds)), 1), int(rng.integers(2**31)), swell)

    made = [plan("bang", False), plan("fourier", False), plan("slow", False), plan("fourier", True), plan("jerk", True, True),
            plan("bang", True), plan("fourier", True, True, True)]
    while len(made) < count - 1:
        made.append(plan(str(rng.choice(["bang", "jerk", "fourier", "fourier", "slow"])), rng.random() < 0.6, rng.random() < 0.3,
                        rng.random() < 0.2))
    made = made[: count - 1]
    repeats = [made[1], *([made[3]] if count >= 12 else [])]
    order = rng.permutation(len(made))
    return [made[k] for k in order][: count - len(repeats)] + repeats
