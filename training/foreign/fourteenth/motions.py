"""Motions of all joints and the carriage: Fourier sums, slews between postures, tows, and free swings."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from curves import Curve, hold, points, speeds, waves
from machines import Arm, Array
from mechanics import STRIPS, State, dry_friction
from scipy.integrate import solve_ivp

DEGREE = np.pi / 180


@dataclass
class Motion:
    """A motion by curves: one of each joint, and one of the carriage where it runs."""

    name: str
    seconds: float
    joints: list[Curve]
    carriage: Curve | None = None

    def at(self, t: Array) -> State:
        """Angles, rates and accelerations at times t."""
        values = [curve(t) for curve in self.joints]
        q, dq, ddq = (np.stack([value[order] for value in values], 1) for order in range(3))
        _, u0, du0 = self.carriage(t) if self.carriage else (0 * t, 0 * t, 0 * t)
        return State(t, q, dq, ddq, u0, du0)


@dataclass
class FreeSwing:
    """A one-link arm let go at rest: its weight, drag, added mass, stated friction and an extra torque that resists it, tau = 0."""

    name: str
    seconds: float
    start: float
    machine: Arm
    extra: Callable[[Array], Array]  # of the angle
    carriage: Curve | None = field(default=None, init=False)

    def acceleration(self, q: Array, v: Array) -> Array:
        """The angular acceleration at angle q and rate v."""
        machine = self.machine
        dx = machine.length[0] / STRIPS
        x = (np.arange(STRIPS) + 0.5) * machine.length[0] / STRIPS
        inertia = (machine.inertia[0] + machine.mass[0] * machine.com[0] ** 2
                   + machine.cm[0] * machine.density * np.pi * machine.diameter[0] ** 2 / 4 * np.sum(x * x) * dx)
        drag = 0.5 * machine.density * machine.diameter[0] * machine.cd[0] * np.sum(x**3) * dx
        coulomb, viscous = machine.friction[0] if machine.friction else (0, 0)
        return -(machine.mass[0] * machine.gravity * machine.com[0] * np.cos(q) + drag * np.abs(v) * v
                 + dry_friction(coulomb, v) + viscous * v + self.extra(q)) / inertia

    def at(self, t: Array) -> State:
        """Angles, rates and accelerations at times t, integrated from the start."""
        found = solve_ivp(lambda _, y: [y[1], self.acceleration(y[0], y[1])], (0, t[-1]), [self.start, 0.0], t_eval=t,
                          method="LSODA", rtol=1e-9, atol=1e-11)
        q, v = found.y
        return State(t, q[:, None], v[:, None], self.acceleration(q, v)[:, None], 0 * t, 0 * t, free=True)


def fourier(rng: np.random.Generator, middle: list[float], amplitude: list[float], top_hz: float, seconds: float = 10.0,
            terms: int = 3, name: str = "f", carriage: Curve | None = None, low_hz: float = 0.1) -> Motion:
    """Each joint swings about its middle in sines of random frequencies."""
    def curve(centre: float, size: float) -> Curve:
        return waves(centre, [(size / terms**0.5 * rng.uniform(0.6, 1.2), rng.uniform(low_hz, top_hz), rng.uniform(0, 6.28))
                              for _ in range(terms)])
    return Motion(name, seconds, [curve(centre, size) for centre, size in zip(middle, amplitude, strict=True)], carriage)


def slews(rng: np.random.Generator, low: list[float], high: list[float], legs: int = 4, times: tuple[float, float] = (0.7, 1.6),
          rests: tuple[float, float] = (0.2, 0.8), stay: float = 0.0, fastest: float = 2.4, name: str = "slew") -> Motion:
    """Moves between random postures with rests; each joint stays where it is with probability `stay`."""
    t, postures = [0.0, 0.3], [rng.uniform(low, high)] * 2
    for _ in range(legs):
        target = rng.uniform(low, high)
        if stay:
            target = np.where(rng.random(len(low)) < stay, postures[-1], target)
        drawn = rng.uniform(*times)
        t.append(t[-1] + max(drawn, 1.875 * np.abs(target - postures[-1]).max() / fastest * rng.uniform(1, 1.8)))
        t.append(t[-1] + rng.uniform(*rests))
        postures += [target, target]
    joints = [points(*[(now, posture[j]) for now, posture in zip(t, postures, strict=True)]) for j in range(len(low))]
    return Motion(name, t[-1], joints)


def tow(posture: list[float], speed: float, seconds: float = 5.0, rise: float = 1.0) -> Motion:
    """The carriage tows the locked arm, from rest to rest."""
    knots = (0.2, 0.0), (0.2 + rise, speed), (seconds - 0.2 - rise * 0.8, speed), (seconds - 0.2, 0.0)
    return Motion("tow", seconds, [hold(angle) for angle in posture], speeds(0.0, *knots))
