"""Four campaigns with a hidden effect of the drive or of the mount: ripple, a spring, a gap, a swaying strut."""

from dataclasses import replace

import numpy as np
from campaign import Campaign, Effect, Outcome, Scene, Sensors
from curves import speeds, waves
from drives import Coupling, sway, torque_of_loose_link
from machines import GRAVITY, arm, tank_arm
from mechanics import at_joint, bare_torques, friction_torques, kinematics
from motions import Motion, fourier, slews, tow


def law_of_ripple(scene: Scene) -> Outcome:
    """Two and four waves per turn of the motor, growing with the load."""
    q, size = scene.state.q[:, 0], 2.0 * (1 + 0.35 * np.abs(scene.tau[:, 0]) / 30)
    return Outcome({"torque_ripple": at_joint(scene.state, 1, size * (np.sin(100 * q + 0.7) + 0.35 * np.sin(200 * q + 2.0)))})


def harmonic_drive() -> Campaign:
    """A joint with a harmonic drive that crawls and slews."""
    rng = np.random.default_rng(16)
    machine = arm(0.8, 0.14, 9.0, 0.36, 0.55, density=0.0, gravity=GRAVITY, known_to=0.015, friction=[(2.5, 3.5)], friction_known_to=0.15)
    plan = [(-2.2, 0.15), (-1.5, 0.25), (-1.0, 0.35), (-2.4, 0.45), (-0.8, 0.2), (-1.8, 0.3)]
    motions = [*(Motion("crawl", 8.0, [speeds(q, (0.2, 0), (0.8, v), (4.0, v), (4.8, -v), (7.4, -v), (7.9, 0))]) for q, v in plan),
               *(slews(rng, [-2.6], [0.4], 3, times=(2.0, 3.5)) for _ in range(5))]
    return Campaign("industrial joint with harmonic drive in air", machine, motions, 125, Sensors(ar=0.0, quantum=2 * np.pi / 65536), "dry",
                    [Motion("crawl", 6.0, [speeds(-2.0, (0.2, 0), (0.8, 0.28), (5.0, 0.28), (5.8, 0))])], law_of_ripple,
                    [Effect("torque_ripple", 1, "two and four per motor turn at 50:1 (100 and 200 per joint turn), growing with load "
                                                "(Ghorbel, Gandhi & Alpeter 2001)")], dt=0.001)


def law_of_elastic_joint(scene: Scene) -> Outcome:
    """The link behind a damped spring, friction on the drive side."""
    machine, state = scene.machine, scene.state
    inertia = machine.inertia[0] + machine.mass[0] * machine.com[0] ** 2
    stiffness, weight = inertia * (2 * np.pi * 9.0) ** 2, machine.mass[0] * machine.gravity * machine.com[0]
    coupling = Coupling(stiffness, 0.06 * np.sqrt(stiffness * inertia))
    passed = torque_of_loose_link(state, inertia, coupling, lambda q, _: weight * np.cos(q))
    tau = at_joint(state, 1, passed) + friction_torques(machine, state)
    return Outcome({"joint_elasticity": tau - scene.tau}, tau)


def elastic_joint() -> Campaign:
    """A shaken joint with a spring."""
    rng = np.random.default_rng(17)

    def shake() -> Motion:
        return Motion("shake", 2.4, [waves(rng.uniform(-2, -0.3), [
            (rng.uniform(0.2, 0.4) / hz**1.5, hz * rng.uniform(0.9, 1.1), rng.uniform(0, 6)) for hz in (0.6, 1.3, 2.2, 3.2)], 0.6)])
    machine = arm(0.7, 0.12, 7.5, 0.33, 0.32, density=0.0, gravity=GRAVITY, known_to=0.02, friction=[(0.8, 0.9)])
    motions = [*(shake() for _ in range(9)),
               *(slews(rng, [-2.4], [0.3], 2, times=(0.35, 0.7), rests=(0.2, 0.4), fastest=5.0) for _ in range(4))]
    return Campaign("elastic industrial joint in air, 500 Hz", machine, motions, 500, Sensors(rates=0.003), "dry", [shake()],
                    law_of_elastic_joint,
                    [Effect("joint_elasticity", 1, "Spong (1987): link on a linear damped spring, 9 Hz, friction on the drive side")],
                    dt=0.0005)


def law_of_worn_gear(scene: Scene) -> Outcome:
    """The link behind a gap and a contact spring with a damper."""
    machine, state, length, diameter = scene.machine, scene.state, scene.machine.length[0], scene.machine.diameter[0]
    water = machine.cm[0] * machine.density * np.pi * diameter * diameter / 4 * length**3 / 3
    inertia = machine.inertia[0] + machine.mass[0] * machine.com[0] ** 2 + water
    drag, stiffness = machine.density * diameter * machine.cd[0] * length**4 / 8, inertia * (2 * np.pi * 22.0) ** 2
    coupling = Coupling(stiffness, 0.9 * np.sqrt(stiffness * inertia), 0.004)
    tau = at_joint(state, 1, torque_of_loose_link(state, inertia, coupling, lambda _, v: drag * abs(v) * v))
    return Outcome({"backlash": tau - scene.tau}, tau)


def worn_gear() -> Campaign:
    """A paddle whose gear has a gap."""
    rng = np.random.default_rng(18)
    motions = [*(fourier(rng, [0], [0.7], 1.1, 8.0, low_hz=0.3) for _ in range(7)),
               *(slews(rng, [-1.2], [1.2], 5, times=(0.5, 1.0)) for _ in range(4))]
    return Campaign("worn gear of a paddle: gap of half a degree", arm(0.5, 0.06, 1.7, 0.25, 0.045, known_to=0.02), motions, 125,
                    Sensors(ar=0.0, rates=0.004), "plain", [fourier(rng, [0], [0.6], 1.0, 8.0, low_hz=0.3)], law_of_worn_gear,
                    [Effect("backlash", 1, "Nordin & Gutman (2002): dead zone of +-4 mrad, contact spring with damper, no pull",
                            ["joint_elasticity"])], dt=0.0005)


def law_of_swaying_strut(scene: Scene) -> Outcome:
    """The hub moves along Y with the strut."""
    machine, state = scene.machine, scene.state
    speed, acceleration = sway(machine, state, 24.0, 2.6, 0.03)
    moved = replace(state, u0=state.u0 + speed, du0=state.du0 + acceleration)
    tau = bare_torques(machine, moved, kinematics(machine, moved))
    return Outcome({"flexible_mount": tau - scene.tau}, tau)


def swaying_strut() -> Campaign:
    """An arm on a strut that gives way."""
    rng = np.random.default_rng(29)
    motions = [*(slews(rng, [-1, -1.4], [1, 1.4], 5, times=(0.45, 1.0), rests=(0.8, 1.4)) for _ in range(9)),
               *(tow([a, b], u, 8.0, 0.5) for a, b, u in [(0.2, 0.3, 0.6), (-0.4, 0.8, 0.9), (0.6, -0.7, 0.7), (0, 0, 0.8)]),
               *(fourier(rng, [0, 0], [0.5, 0.7], 0.8) for _ in range(3))]
    return Campaign("carriage strut that sways", tank_arm(), motions, 100, Sensors(rates=0.004), "plain",
                    [slews(rng, [-1, -1.3], [1, 1.3], times=(0.5, 1.0), rests=(0.7, 1.2))], law_of_swaying_strut,
                    [Effect("flexible_mount", None, "strut of 24 kg, 2.6 Hz, damping 3 %, along Y; arm, water and strut coupled")],
                    dt=0.001)
