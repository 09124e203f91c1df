"""Torques of an arm without any hidden effect: Newton on links, Morison on strips, stated friction, belt and gear."""

from dataclasses import dataclass, field

import numpy as np
from machines import Arm, Array

STRIPS = 48  # of a link
SKEW = 0.03  # share by which Coulomb friction is larger one way


@dataclass
class State:
    """Angles of the joints and speed of the carriage at all times, [times, joints] and [times]."""

    t: Array
    q: Array
    dq: Array
    ddq: Array
    u0: Array
    du0: Array
    free: bool = False
    clock: Array = field(default_factory=lambda: np.zeros(0))
    total: float = 0.0  # the whole campaign's duration

    @property
    def dt(self) -> float:
        """The step of the grid of times."""
        return float(self.t[1] - self.t[0])


@dataclass
class Link:
    """One link at all times: its joint, its axes [times, 2], and its strips' normal speed and acceleration [times, strips]."""

    place: Array
    velocity: Array
    acceleration: Array
    along: Array
    across: Array
    spin: Array
    dspin: Array
    x: Array
    dx: float
    w: Array
    dw: Array
    axial: Array

    def point(self, x: float) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration of the point at x from the joint."""
        spin, dspin = self.spin[:, None], self.dspin[:, None]
        return (self.place + x * self.along, self.velocity + x * spin * self.across,
                self.acceleration + x * (dspin * self.across - spin**2 * self.along))


def kinematics(machine: Arm, state: State) -> list[Link]:
    """Every link's motion as vectors; dw is the derivative of the normal speed, as the strip sees it."""
    phi, spins, dspins = (np.cumsum(values, 1) for values in (state.q, state.dq, state.ddq))
    place = np.zeros((len(state.t), 2))
    velocity, acceleration = np.stack([0 * state.u0, state.u0], 1), np.stack([0 * state.du0, state.du0], 1)
    links = []
    for i in range(machine.links):
        along = np.stack([np.cos(phi[:, i]), np.sin(phi[:, i])], 1)
        across = np.stack([-along[:, 1], along[:, 0]], 1)
        x = (np.arange(STRIPS) + 0.5) * machine.length[i] / STRIPS
        spin, dspin = spins[:, i, None], dspins[:, i, None]
        axial = np.sum(velocity * along, 1)
        w = np.sum(velocity * across, 1)[:, None] + spin * x
        dw = (np.sum(acceleration * across, 1)[:, None] + dspin * x) - spin * axial[:, None]
        links.append(Link(place, velocity, acceleration, along, across, spins[:, i], dspins[:, i], x, machine.length[i] / STRIPS,
                          w, dw, axial))
        place, velocity, acceleration = links[-1].point(machine.length[i])
    return links


def cross(a: Array, b: Array) -> Array:
    """The cross product of plane vectors."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def at_joint(state: State, joint: int, values: Array | float) -> Array:
    """Torques that are `values` at one joint and zero at the others."""
    out = np.zeros_like(state.q)
    out[:, joint - 1] = values
    return out


def torques_of_force(links: list[Link], i: int, force: Array, place: Array) -> Array:
    """Torques at all joints of a force at a place of link i."""
    out = np.zeros((len(force), len(links)))
    for j in range(i + 1):
        out[:, j] = cross(place - links[j].place, force)
    return out


def normal_torques(links: list[Link], i: int, load: Array) -> Array:
    """Torques at all joints of a normal load per length on the strips of link i."""
    link, out = links[i], np.zeros((len(load), len(links)))
    force, moment = load.sum(1) * link.dx, (load * link.x).sum(1) * link.dx
    for j in range(i + 1):
        out[:, j] = moment + force * cross(link.place - links[j].place, link.across)
    return out


def rigid_torques(machine: Arm, state: State, links: list[Link]) -> Array:
    """Torques of the dry arm without friction."""
    out = np.zeros_like(state.q)
    for i, link in enumerate(links):
        place, _, acceleration = link.point(machine.com[i])
        out += torques_of_force(links, i, machine.mass[i] * (acceleration + np.array([0, machine.gravity])), place)
        out[:, : i + 1] += (machine.inertia[i] * link.dspin)[:, None]
    return out


def drag_torques(machine: Arm, links: list[Link], i: int, cd: Array | float = 1.0, w: Array | None = None) -> Array:
    """Torques of the drag on link i, at normal speeds w relative to the water where given."""
    w = links[i].w if w is None else w
    return normal_torques(links, i, 0.5 * machine.density * machine.diameter[i] * cd * np.abs(w) * w)


def added_mass_torques(machine: Arm, links: list[Link], i: int, cm: float = 1.0) -> Array:
    """Torques of the added mass of link i."""
    return normal_torques(links, i, cm * machine.density * np.pi * machine.diameter[i] ** 2 / 4 * links[i].dw)


def dry_friction(coulomb: float, rate: Array) -> Array:
    """Coulomb's friction, a little larger one way."""
    sign = np.tanh(rate / 0.004)
    return coulomb * sign * (1 + SKEW * sign)


def friction_torques(machine: Arm, state: State) -> Array:
    """Torques of the stated friction."""
    out = np.zeros_like(state.q)
    for j, (coulomb, viscous) in enumerate(machine.friction or []):
        out[:, j] = dry_friction(coulomb, state.dq[:, j]) + viscous * state.dq[:, j]
    return out


def bare_torques(machine: Arm, state: State, links: list[Link]) -> Array:
    """What the joints must supply without any hidden effect."""
    out = rigid_torques(machine, state, links) + friction_torques(machine, state)
    if machine.density > 0:
        for i in range(machine.links):
            out += drag_torques(machine, links, i, machine.cd[i]) + added_mass_torques(machine, links, i, machine.cm[i])
    return out


def behind_belt(machine: Arm, tau: Array) -> Array:
    """Torques of the motors that turn the joints, by a belt where there is one."""
    return np.stack([tau[:, 0] - tau[:, 1], tau[:, 1]], 1) if machine.remote else tau


def behind_drive(machine: Arm, tau: Array, state: State) -> Array:
    """Torques as sensors at the motors read them; the loss of a gear follows the sign of torque times rate."""
    tau = behind_belt(machine, tau)
    if machine.gear:
        ratio, efficiency = machine.gear
        sign = np.tanh(tau * state.dq / 1e-4)
        tau = tau / ratio * np.where(sign > 0, 1 + sign * (1 / efficiency - 1), 1 + sign * (1 - efficiency))
    return tau
