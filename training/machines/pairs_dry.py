"""Two effects of comparable size at once in dry machines: 46, 47, 51, 53 and 55."""

import numpy as np
from arms import PI, Arm, G, arm_yaml, motion_of, pendulum, point_mass, rigid
from cards import card, hidden, machine
from drives import free_pendulum, lugre
from logger import record
from motions import multisine, picks


@machine(46, "pair")
def m46(rng):
    """Driven pendulum in an oil bath (viscous) whose torque comes 16 ms late."""
    d = pendulum("driven pendulum, oil bath, slow bus", 0.4, 0.9, 0.25, 0.012, 0.03, 0.03)
    a = Arm(d, rng)
    recs, dt = [], 5e-4
    for _ in range(9):
        q = multisine(14, dt, [rng.uniform(0.5, 1.0)], 0.2, 2.6, 9, rng, rng.uniform(-2.2, -0.8))
        dq, _, K = motion_of(a, q, dt)
        tau = rigid(a, K) + 0.16 * dq
        recs.append(record(dt, 250, q, tau, rng, sd=0.07, tq=0.01, delay=0.016))
    return d, recs, card([hidden("viscous_friction", 1, viscous=(0.16, "N m s/rad")), hidden("sensor_timing", delay=(0.016, "s"))])


@machine(47, "pair")
def m47(rng):
    """Two-joint upright arm: tool of 0.28 kg forgotten, and dry seal friction at joint 1."""
    d = arm_yaml("two-joint arm, new tool, stiff seals", [(0.4, 0.05, 2.1, 0.2, 0.03, 0.03), (0.35, 0.04, 1.2, 0.17, 0.013, 0.03)], g=G)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(9):
        q = (
            picks(rng, dt, 2, (-1.0, -1.8), (2.0, 1.8), (0.6, 1.8), 0.3)
            if k % 2
            else multisine(14, dt, [1.0, 1.2], 0.1, 0.9, 6, rng, (0.4, 0))
        )
        dq, _, K = motion_of(a, q, dt)
        tau = rigid(a, K) + point_mass(a, K, 0.28)
        tau[:, 0] += lugre(dq[:, 0], dt, 1.4, z0=5e-4)
        recs.append(record(dt, 200, q, tau, rng, sd=(0.3, 0.1), rates="noisy"))
    facts = card(
        [hidden("payload_mass", mass=(0.28, "kg")), hidden("coulomb_friction", 1, coulomb=(1.4, "N m"))],
        tolerated=["stribeck_friction"],
    )
    return d, recs, facts


@machine(51, "pair")
def m51(rng):
    """Upright wrist: ripple of 20 periods a turn and the inertia of the geared rotor."""
    d = arm_yaml("robot wrist with strain-wave gear", [(0.4, 0.06, 2.2, 0.2, 0.03, 0.03)], g=G)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for _ in range(9):
        q = multisine(16, dt, [rng.uniform(0.5, 1.3)], 0.1, 1.6, 8, rng, -1.2)
        _, ddq, K = motion_of(a, q, dt)
        tau = rigid(a, K) + 0.05 * ddq + 0.35 * np.sin(20 * q + 0.4)
        recs.append(record(dt, 250, q, tau, rng, sd=0.10, qq=2 * PI / 2**16, rates="noisy", acc=True))
    facts = card(
        [
            hidden("torque_ripple", 1, amplitude=(0.35, "N m"), periods=(20.0, "1/rev")),
            hidden("rotor_inertia", 1, inertia=(0.05, "kg m2")),
        ]
    )
    return d, recs, facts


@machine(53, "pair")
def m53(rng):
    """Two-joint upright arm: joint 2 has dry friction and its motor constant is 14 % low."""
    d = arm_yaml("two-joint arm, wrong motor constant", [(0.5, 0.06, 4.0, 0.24, 0.09, 0.01), (0.4, 0.05, 2.0, 0.19, 0.03, 0.01)], g=G)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(9):
        q = (
            picks(rng, dt, 2, (-1.0, -1.5), (1.8, 1.5), (0.7, 1.8), 0.3)
            if k % 2
            else multisine(14, dt, [1.0, 1.0], 0.1, 0.9, 6, rng, (0.4, 0.2))
        )
        dq, _, K = motion_of(a, q, dt)
        tau = rigid(a, K)
        tau[:, 1] += lugre(dq[:, 1], dt, 0.45, z0=5e-4)
        tau[:, 1] *= 0.86
        recs.append(record(dt, 200, q, tau, rng, sd=(0.3, 0.08), rates="noisy"))
    facts = card(
        [hidden("torque_gain", 2, error=(-0.14, "1")), hidden("coulomb_friction", 2, coulomb=(0.45 * 0.86, "N m"))],
        tolerated=["stribeck_friction"],
        note="friction as seen by the sensor 0.387, truly 0.45",
    )
    return d, recs, facts


@machine(55, "pair")
def m55(rng):
    """Free pendulum with felt washer: dry and viscous friction of like size, zero torque."""
    d = pendulum("pendulum on a shaft with felt washer", 0.35, 0.42, 0.27, 0.0062, 0.03)
    a = Arm(d, rng)
    recs = [
        record(5e-4, 250, free_pendulum(a, s, 16, 5e-4, Fc=0.009, Fv=0.0042, z0=2e-3), np.zeros((32001, 1)), rng, qq=2 * PI / 10000)
        for s in (2.6, -2.1, 1.6, -1.2, 0.8, 0.5)
    ]
    facts = card([hidden("coulomb_friction", 1, coulomb=(0.009, "N m")), hidden("viscous_friction", 1, viscous=(0.0042, "N m s/rad"))])
    return d, recs, facts
