"""Checks of the generator: its physics against other formulas, closed forms, and balances of energy and force."""

from dataclasses import replace

import numpy as np
from curves import waves
from drives import Coupling, sway, torque_of_loose_link
from machines import GRAVITY, Arm, Array, arm, rod_inertia, tank_arm
from mechanics import State, added_mass_torques, bare_torques, behind_drive, drag_torques, kinematics, rigid_torques
from motions import FreeSwing, Motion, fourier, slews, tow
from responses import half_derivative


def check_physics(rng: np.random.Generator) -> None:
    """Run all checks, in a second or two."""
    for links in (1, 2, 3):
        machine = arm(*(rng.uniform(low, high, links) for low, high in ((0.3, 0.6), (0.05, 0.08), (0.5, 3), (0.1, 0.3), (0.01, 0.1))),
                      gravity=GRAVITY)
        ride = waves(0, [(0.3, 0.3, 0.4)])
        check_lagrange(machine, fourier(rng, list(rng.uniform(-1, 1, links)), [0.8] * links, 0.6, 4.0, carriage=ride))
        check_power(machine, fourier(rng, list(rng.uniform(-1, 1, links)), [0.8] * links, 0.6, 4.0).at(np.arange(0, 4, 1e-3)))
        check_tow(machine)
    check_closed_forms(rng)
    check_belt(rng)
    check_free_swing()
    check_responses()
    check_spring(rng)
    check_strut(rng)


def agree(name: str, first: Array | float, second: Array | float, limit: float) -> None:
    """Fail where two results differ by more than the limit, as a share of the largest value of the second."""
    off = float(np.abs(first - second).max() / np.abs(second).max())
    assert off < limit, f"{name}: {off:.2e} apart"


def lagrangian(machine: Arm, q: Array, dq: Array, u0: float) -> float:
    """Kinetic less potential energy, from finite differences of places alone."""
    def places(angles: Array, hub: float) -> Array:
        phi, here, out = np.cumsum(angles), np.array([0, hub]), []
        for i in range(machine.links):
            axis = np.array([np.cos(phi[i]), np.sin(phi[i])])
            out.append(here + machine.com[i] * axis)
            here = here + machine.length[i] * axis
        return np.array(out)
    h = 1e-5
    velocity = (places(q + h * dq, h * u0) - places(q - h * dq, -h * u0)) / (2 * h)
    kinetic = np.sum(machine.mass * (velocity**2).sum(1)) + np.sum(machine.inertia * np.cumsum(dq) ** 2)
    return float(0.5 * kinetic - np.sum(machine.mass * machine.gravity * places(q, 0.0)[:, 1]))


def check_lagrange(machine: Arm, motion: Motion) -> None:
    """Torques of the rigid arm on a moving carriage by Lagrange's equations; the derivative of the strips' normal speed."""
    def momentum(time: float, unit: Array) -> float:
        state = motion.at(np.array([time]))
        q, dq, u0 = state.q[0], state.dq[0], state.u0[0]
        return (lagrangian(machine, q, dq + 1e-3 * unit, u0) - lagrangian(machine, q, dq - 1e-3 * unit, u0)) / 2e-3
    h = 2e-4
    for time in (0.7, 1.9, 3.1):
        state = motion.at(np.array([time]))
        q, dq, u0, lagrange = state.q[0], state.dq[0], state.u0[0], []
        for unit in np.eye(machine.links):
            slope = (lagrangian(machine, q + 1e-4 * unit, dq, u0) - lagrangian(machine, q - 1e-4 * unit, dq, u0)) / 2e-4
            lagrange.append((momentum(time + h, unit) - momentum(time - h, unit)) / (2 * h) - slope)
        agree("Lagrange", np.array(lagrange), rigid_torques(machine, state, kinematics(machine, state))[0], 1e-4)
    for link in kinematics(machine, motion.at(np.arange(0, 4, 1e-3))):  # after the fade, whose third derivative jumps
        agree("acceleration of strips", ((link.w[2:] - link.w[:-2]) / 2e-3)[1100:], link.dw[1:-1][1100:], 1e-3)


def check_power(machine: Arm, state: State) -> None:
    """The power of the joints is that of masses, weights and drag."""
    links, energy = kinematics(machine, state), np.zeros(len(state.t))
    for i, link in enumerate(links):
        place, velocity, _ = link.point(machine.com[i])
        energy += 0.5 * machine.mass[i] * (velocity**2).sum(1) + 0.5 * machine.inertia[i] * link.spin**2
        energy += machine.mass[i] * machine.gravity * place[:, 1]
    power = (rigid_torques(machine, state, links) * state.dq).sum(1)
    work = np.concatenate([[0], np.cumsum((power[1:] + power[:-1]) / 2) * state.dt])
    agree("energy", work, energy - energy[0], 1e-4)
    by_joints = sum((drag_torques(machine, links, i) * state.dq).sum(1) for i in range(machine.links))
    by_strips = sum((0.5 * machine.density * machine.diameter[i] * np.abs(link.w) ** 3).sum(1) * link.dx for i, link in enumerate(links))
    agree("power of drag", by_joints, by_strips, 1e-10)


def check_tow(machine: Arm) -> None:
    """The drag of link 1 under tow, in closed form."""
    state = tow([0.4] + [0.0] * (machine.links - 1), 0.8).at(np.arange(0, 5, 0.01))
    across = state.u0 * np.cos(0.4)
    exact = machine.density * machine.diameter[0] * machine.length[0] ** 2 / 4 * across * np.abs(across)
    agree("drag under tow", drag_torques(machine, kinematics(machine, state), 0)[:, 0], exact, 1e-10)


def check_closed_forms(rng: np.random.Generator) -> None:
    """Drag and added mass of a paddle that turns."""
    paddle = arm(0.5, 0.06, 1.7, 0.25, 0.045)
    state = fourier(rng, [0.2], [0.8], 0.6, 4.0).at(np.arange(0, 4, 1e-3))
    links, rate, length, diameter = kinematics(paddle, state), state.dq[:, 0], paddle.length[0], paddle.diameter[0]
    agree("drag", drag_torques(paddle, links, 0)[:, 0], paddle.density * diameter * length**4 / 8 * rate * np.abs(rate), 1e-3)
    inertia = paddle.density * np.pi * diameter**2 / 4 * length**3 / 3
    agree("added mass", added_mass_torques(paddle, links, 0)[:, 0], inertia * state.ddq[:, 0], 1e-3)


def check_belt(rng: np.random.Generator) -> None:
    """The power of both motors is that of both joints."""
    machine = tank_arm(remote=True)
    state = fourier(rng, [0, 0.3], [0.8, 0.8], 0.6, 4.0).at(np.arange(0, 4, 0.01))
    tau = bare_torques(machine, state, kinematics(machine, state))
    agree("belt", (behind_drive(machine, tau, state) * np.cumsum(state.dq, 1)).sum(1), (tau * state.dq).sum(1), 1e-10)


def check_free_swing() -> None:
    """A pendulum that is let go needs no torque; its acceleration is the derivative of its rate."""
    def lift(q: Array) -> Array:
        return -11.0 * np.cos(q)
    machine = arm(0.6, 0.05, 9.2, 0.3, rod_inertia(0.6, 0.05, 9.2), gravity=GRAVITY, cd=1.15, cm=0.95, friction=[(0.06, 0.0)])
    state = FreeSwing("decay", 8.0, -0.8, machine, lift).at(np.arange(0, 8, 0.002))
    agree("free swing", bare_torques(machine, state, kinematics(machine, state))[:, 0], -lift(state.q[:, 0]), 1e-6)
    agree("rate of the swing", np.gradient(np.gradient(state.q[:, 0], 0.002), 0.002)[5:-5], state.ddq[5:-5, 0], 0.02)


def check_responses() -> None:
    """Half derivatives of a line, and of a sine after 50 s."""
    t = np.arange(0, 5, 0.001)
    agree("half derivative of a line", half_derivative(t, 0.001)[10:], 2 * np.sqrt(t)[10:], 1e-10)
    t = np.arange(0, 60, 0.002)
    agree("half derivative of a sine", half_derivative(np.sin(2 * t), 0.002)[25000:],
          (np.sqrt(2 * np.pi) * np.sin(2 * t + np.pi / 4))[25000:], 0.01)


def check_spring(rng: np.random.Generator) -> None:
    """A link on a stiff spring needs the torque of a rigid one."""
    state = fourier(rng, [0], [0.5], 0.5, 5.0).at(np.arange(0, 5, 0.0005))
    coupling = Coupling(0.5 * (2 * np.pi * 60) ** 2, 0.1 * 0.5 * 2 * np.pi * 60)
    passed = torque_of_loose_link(state, 0.5, coupling, lambda *_: 0.0)
    agree("stiff spring", passed[2000:], 0.5 * state.ddq[2000:, 0], 0.02)


def check_strut(rng: np.random.Generator) -> None:
    """The forces on a swaying strut are in balance."""
    machine, mass, zeta, omega = tank_arm(), 16.0, 0.03, 2 * np.pi * 2.6
    motion = slews(rng, [-1, -1.4], [1, 1.4], 3)
    state = motion.at(np.arange(0, motion.seconds, 5e-4))
    speed, acceleration = sway(machine, state, mass, 2.6, zeta)
    force = np.zeros(len(state.t))
    for i, link in enumerate(kinematics(machine, replace(state, u0=state.u0 + speed, du0=state.du0 + acceleration))):
        drag = 0.5 * machine.density * machine.diameter[i] * machine.cd[i] * np.abs(link.w) * link.w
        load = drag + machine.cm[i] * machine.density * np.pi * machine.diameter[i] ** 2 / 4 * link.dw
        force += machine.mass[i] * link.point(machine.com[i])[2][:, 1] + load.sum(1) * link.dx * link.across[:, 1]
    strut = mass * (acceleration + omega**2 * np.cumsum(speed) * state.dt + 2 * zeta * omega * speed)
    agree("strut", -strut, force, 1e-10)
