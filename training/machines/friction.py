"""Dry machines 0 to 7: pendulums, drives and industrial arms, most of them with friction."""

import numpy as np
from arms import INDUSTRIAL, PI, Arm, G, arm_yaml, motion_of, pendulum, rigid
from cards import card, hidden, machine
from drives import free_pendulum, lugre
from logger import record
from motions import multisine, path, picks


@machine(0, "dry")
def m00(rng):
    """Free pendulum, oil-lubricated bearings, optical encoder, torque exactly 0."""
    d = pendulum("free pendulum on oil-filled bearings", 0.35, 0.42, 0.27, 0.0062, 0.05)
    a = Arm(d, rng)
    recs = [
        record(1e-3, 200, free_pendulum(a, s, 25, 1e-3, Fv=0.0031), np.zeros((25001, 1)), rng, qq=2 * PI / 8192)
        for s in (2.4, -2.0, 1.5, -1.1, 0.7, 0.4)
    ]
    return d, recs, card([hidden("viscous_friction", 1, viscous=(0.0031, "N m s/rad"))])


@machine(1, "dry")
def m01(rng):
    """Free pendulum on a plain bushing (Dahl friction), zero torque, rates differentiated by the logger."""
    d = pendulum("free pendulum on plain bushing", 0.5, 0.9, 0.36, 0.016, 0.03)
    a = Arm(d, rng)
    recs = [
        record(
            5e-4,
            250,
            free_pendulum(a, s, T, 5e-4, Fc=0.052, z0=2e-3),
            np.zeros((int(T * 2000) + 1, 1)),
            rng,
            qq=2 * PI / 4096,
            rates="diff",
        )
        for s, T in ((2.0, 22), (-1.6, 20), (1.3, 18), (-1.0, 15), (0.7, 12))
    ]
    return d, recs, card([hidden("coulomb_friction", 1, coulomb=(0.052, "N m"))], tolerated=["stribeck_friction"])


@machine(2, "dry")
def m02(rng):
    """Quasi-direct drive, swing-ups and multisines, torque from motor current (quantised)."""
    d = pendulum("quasi-direct drive with a pendulum", 0.5, 0.68, 0.46, 0.009, 0.05, 0.03)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(8):
        if k < 4:
            q = multisine(12, dt, [rng.uniform(1.0, 2.4)], 0.15, 1.1, 6, rng, -PI / 2)
        else:
            pts = -PI / 2 + np.array([0, 0.5, -0.9, 1.5, -2.0, 2.7, 3.1, 3.1, 0])[:, None] * rng.uniform(0.8, 1.0)
            q = path(pts, [0.6, 0.6, 0.7, 0.8, 0.9, 0.9, 0.4, 1.6], [0.05] * 6 + [2.0, 0.6], dt)
        dq, _, K = motion_of(a, q, dt)
        tau = rigid(a, K)
        tau[:, 0] += lugre(dq[:, 0], dt, 0.21, z0=3e-3)
        recs.append(record(dt, 400, q, tau, rng, sd=0.10, tq=0.022, qq=2 * PI / 16384, rates="noisy"))
    return d, recs, card([hidden("coulomb_friction", 1, coulomb=(0.21, "N m"))], tolerated=["stribeck_friction"])


@machine(3, "dry")
def m03(rng):
    """Servo with 100:1 gear lifting a bar; torque = motor current times ratio."""
    d = pendulum("geared servo lifting a bar", 0.4, 0.8, 0.2, 0.011, 0.02, 0.03)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for _ in range(7):
        q = multisine(15, dt, [rng.uniform(0.4, 0.9)], 0.2, 2.8, 9, rng, rng.uniform(-2.2, -0.6))
        _, ddq, K = motion_of(a, q, dt)
        tau = rigid(a, K) + 0.034 * ddq
        recs.append(record(dt, 250, q, tau, rng, sd=0.05, ar=0.5, qq=2 * PI / 20000))
    return d, recs, card([hidden("rotor_inertia", 1, inertia=(0.034, "kg m2"))])


@machine(4, "dry")
def m04(rng):
    """Two-joint industrial arm upright, cycloid gearboxes: viscous and Coulomb friction of similar size."""
    d = arm_yaml("two-joint industrial arm, cycloid gears", INDUSTRIAL, g=G)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    fc, fv = (9.0, 5.5), (8.0, 4.2)
    for k in range(10):
        q = (
            picks(rng, dt, 2, (-0.4, -1.8), (1.9, 1.8), (0.7, 2.4), 0.25)
            if k < 6
            else multisine(14, dt, [0.8, 1.0], 0.1, 0.8, 6, rng, (0.8, -0.5))
        )
        dq, _, K = motion_of(a, q, dt)
        tau = rigid(a, K)
        for j in range(2):
            tau[:, j] += lugre(dq[:, j], dt, fc[j], Fv=fv[j], z0=4e-4)
        recs.append(record(dt, 250, q, tau, rng, sd=(1.5, 0.8), tq=0.12, rates="noisy"))
    facts = card(
        [
            hidden("coulomb_friction", 1, coulomb=(9.0, "N m")),
            hidden("coulomb_friction", 2, coulomb=(5.5, "N m")),
            hidden("viscous_friction", 1, viscous=(8.0, "N m s/rad")),
            hidden("viscous_friction", 2, viscous=(4.2, "N m s/rad")),
        ],
        tolerated=["stribeck_friction"],
    )
    return d, recs, facts


@machine(5, "dry")
def m05(rng):
    """Three-joint upright arm with gearboxes, pick-and-place and multisines."""
    d = arm_yaml(
        "three-joint handling arm",
        [(0.6, 0.12, 18, 0.28, 0.7, 0.03), (0.5, 0.1, 9, 0.22, 0.24, 0.03), (0.25, 0.07, 2.4, 0.11, 0.018, 0.03)],
        g=G,
    )
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    fc, fv = (12.0, 7.0, 1.6), (9.0, 5.0, 1.1)
    for k in range(9):
        q = (
            picks(rng, dt, 3, (0.0, -1.5, -1.2), (1.7, 1.5, 1.2), (0.8, 2.2), 0.3)
            if k % 2
            else multisine(14, dt, [0.6, 0.8, 1.0], 0.1, 0.9, 6, rng, (0.9, -0.4, 0.2))
        )
        dq, _, K = motion_of(a, q, dt)
        tau = rigid(a, K)
        for j in range(3):
            tau[:, j] += lugre(dq[:, j], dt, fc[j], Fv=fv[j], z0=4e-4)
        recs.append(record(dt, 200, q, tau, rng, sd=(2.0, 1.1, 0.2), tq=0.05))
    facts = card(
        [hidden("coulomb_friction", j + 1, coulomb=(fc[j], "N m")) for j in range(3)]
        + [hidden("viscous_friction", j + 1, viscous=(fv[j], "N m s/rad")) for j in range(3)],
        tolerated=["stribeck_friction"],
    )
    return d, recs, facts


@machine(6, "dry")
def m06(rng):
    """Horizontal rotary table with a greased ring: friction falls with speed (LuGre, Tustin exponent 1)."""
    d = arm_yaml("rotary table, greased slide ring", [(0.6, 0.05, 3.0, 0.3, 0.1, 0.03)])
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k, sc in enumerate((0.04, 0.08, 0.15, 0.3, 0.6, 1.0, 1.6, 0.1, 0.5)):
        q = (
            multisine(20, dt, [2.5 * min(1, sc + 0.2)], 0.03, 0.1 + 0.25 * sc, 5, rng)
            if k < 7
            else path(np.array([0, 1, -1, 1.5, -0.5, 0])[:, None] * sc * 2, 3.0, 0.5, dt)
        )
        dq, _, K = motion_of(a, q, dt)
        tau = rigid(a, K)
        tau[:, 0] += lugre(dq[:, 0], dt, 0.30, 0.62, vs=0.22, z0=5e-4, alpha=1.0)
        recs.append(record(dt, 200, q, tau, rng, sd=0.025, qq=2 * PI / 65536, rates="noisy"))
    facts = card(
        [hidden("stribeck_friction", 1, partial=["coulomb_friction"], excess=(0.32, "N m"), speed=(0.22, "rad/s"))],
        tolerated=["coulomb_friction"],
        note="Fc 0.30 N m is there too: Coulomb beside Stribeck is right, Coulomb alone is half",
    )
    return d, recs, facts


@machine(7, "dry")
def m07(rng):
    """Upright arm, worm gear at joint 1 whose friction is 16 % of the load it carries."""
    d = arm_yaml("worm-gear lifting arm", [(0.5, 0.06, 4.0, 0.25, 0.085, 0.03), (0.4, 0.05, 1.8, 0.2, 0.025, 0.03)], g=G)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(9):
        q = (
            picks(rng, dt, 2, (-1.4, -1.7), (1.6, 1.7), (1.0, 2.5), 0.3)
            if k % 3
            else multisine(16, dt, [1.2, 1.0], 0.08, 0.6, 5, rng, (0.0, 0.2))
        )
        dq, _, K = motion_of(a, q, dt)
        tau = rigid(a, K)
        load = np.abs(tau[:, 0])
        tau[:, 0] += lugre(dq[:, 0], dt, 0.15 + 0.16 * load, z0=5e-4)
        recs.append(record(dt, 250, q, tau, rng, sd=(0.35, 0.1), rates="noisy" if k % 2 else None))
    facts = card(
        [hidden("load_friction", 1, partial=["coulomb_friction"], fraction=(0.16, "1"))],
        tolerated=["coulomb_friction", "stribeck_friction"],
        note="a constant 0.15 N m stands beside the load-dependent part",
    )
    return d, recs, facts
