"""Motions that are solved for: a link behind a spring and a gap, and a hub on a swaying strut."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from machines import Arm, Array
from mechanics import State, kinematics


@dataclass
class Coupling:
    """A spring with a damper and a gap to each side; across a gap it cannot pull."""

    stiffness: float
    damping: float
    gap: float = 0.0

    def torque(self, twist: float, rate: float) -> float:
        """What passes at a twist and its rate."""
        if abs(twist) <= self.gap:
            return 0.0
        passed = self.stiffness * (twist - self.gap * np.sign(twist)) + self.damping * rate
        return passed if passed * twist > 0 or not self.gap else 0.0


def torque_of_loose_link(state: State, inertia: float, coupling: Coupling, load: Callable[[float, float], float]) -> Array:
    """The torque in the coupling where inertia q'' + load(q, q') = torque; midpoint rule with two steps to one of the grid."""
    drive, drive_rate, out = state.q[:, 0], state.dq[:, 0], np.zeros(len(state.t))
    first = load(drive[0], 0.0)
    q, v = drive[0] - (first / coupling.stiffness + coupling.gap * np.sign(first)), 0.0
    steps = 2
    h = state.dt / steps

    def acceleration(i: int, share: float, q: float, v: float) -> float:
        angle = drive[i] + share * (drive[i + 1] - drive[i])
        rate = drive_rate[i] + share * (drive_rate[i + 1] - drive_rate[i])
        return (coupling.torque(angle - q, rate - v) - load(q, v)) / inertia
    for i in range(len(out)):
        out[i] = coupling.torque(drive[i] - q, drive_rate[i] - v)
        if i == len(out) - 1:
            break
        for step in range(steps):
            now = acceleration(i, step / steps, q, v)
            middle, middle_rate = q + h / 2 * v, v + h / 2 * now
            then = acceleration(i, (step + 0.5) / steps, middle, middle_rate)
            q, v = q + h * middle_rate, v + h * then
    return out


def sway(machine: Arm, state: State, mass: float, hz: float, zeta: float) -> tuple[Array, Array]:
    """Speed and acceleration, against the carriage, of a hub on a sprung strut that moves along Y, coupled to arm and water."""
    links = kinematics(machine, state)
    stiffness, damping = mass * (2 * np.pi * hz) ** 2, 2 * zeta * mass * 2 * np.pi * hz
    across = np.stack([link.across[:, 1] for link in links], 1)
    along = np.stack([link.along[:, 1] for link in links], 1)
    inert = sum(machine.mass[i] * link.point(machine.com[i])[2][:, 1] for i, link in enumerate(links))
    w = np.stack([link.w for link in links], 1)
    dw = np.stack([link.dw.mean(1) for link in links], 1)
    spin = np.stack([link.spin for link in links], 1)
    water = np.array([machine.cm[i] * machine.density * np.pi * machine.diameter[i] ** 2 / 4 * machine.length[i]
                      for i in range(machine.links)])
    half_drag = 0.5 * machine.density * machine.diameter * machine.cd * np.array([link.dx for link in links])
    moved = mass + (machine.mass.sum() + (across**2 * water).sum(1))
    y = v = 0.0
    speed, acceleration = np.zeros(len(state.t)), np.zeros(len(state.t))
    for i in range(len(state.t)):
        normal = w[i] + v * across[i][:, None]
        force = (inert[i] + np.sum(half_drag * across[i] * (np.abs(normal) * normal).sum(1))
                 + np.sum(water * across[i] * (dw[i] - spin[i] * v * along[i])))
        a = (-force - stiffness * y - damping * v - mass * state.du0[i]) / moved[i]
        speed[i], acceleration[i] = v, a
        v += state.dt * a
        y += state.dt * v
    return speed, acceleration
