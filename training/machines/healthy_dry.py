"""Healthy dry machines with unpleasant records: 60 to 64, and 70."""

import numpy as np
from arms import INDUSTRIAL, PI, Arm, G, arm_yaml, motion_of, pendulum, rigid
from cards import card, machine
from drives import free_pendulum, lugre
from logger import record
from motions import multisine, picks


@machine(60, "healthy")
def m60(rng):
    """Air-bearing pendulum drive; coloured torque noise (correlation 0.25 s), 5 %."""
    d = pendulum("air-bearing pendulum drive, humming amplifier off", 0.4, 0.9, 0.25, 0.012, 0.03, 0.03)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for _ in range(9):
        q = multisine(rng.uniform(8, 25), dt, [rng.uniform(0.4, 1.0)], 0.15, 2.0, 8, rng, rng.uniform(-2.2, -0.8))
        *_, K = motion_of(a, q, dt)
        recs.append(record(dt, 250, q, rigid(a, K), rng, sd=0.08, ar=0.985, rates="noisy"))
    return d, recs, card()


@machine(61, "healthy")
def m61(rng):
    """Direct-drive two-joint arm; noise differs by up to five between recordings, masses 4 %."""
    d = arm_yaml("two-joint laboratory arm, direct drives", [(0.4, 0.05, 2.1, 0.2, 0.03, 0.04), (0.35, 0.04, 1.2, 0.17, 0.013, 0.04)], g=G)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(12):
        q = (
            picks(rng, dt, 2, (-1.0, -1.8), (2.0, 1.8), (0.6, 1.6), 0.3, K=int(rng.integers(5, 14)))
            if k % 2
            else multisine(14, dt, [1.0, 1.2], 0.1, 1.0, 6, rng, (0.4, 0))
        )
        *_, K = motion_of(a, q, dt)
        f = 5 ** rng.uniform(0, 1)
        recs.append(record(dt, 200, q, rigid(a, K), rng, sd=np.array([0.12, 0.04]) * f, ar=0.5))
    return d, recs, card()


@machine(62, "healthy")
def m62(rng):
    """Rod on a torque cell: heavy-tailed noise (t3), torque in steps of 0.05 N m, encoder of 4096 steps, lagging rates."""
    d = pendulum("hanging rod on a torque cell", 0.5, 0.68, 0.3, 0.015, 0.05, 0.03)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for _ in range(8):
        q = multisine(15, dt, [rng.uniform(0.6, 1.4)], 0.15, 1.2, 6, rng, -PI / 2)
        *_, K = motion_of(a, q, dt)
        recs.append(record(dt, 300, q, rigid(a, K), rng, sd=0.07, tails=True, tq=0.05, qq=2 * PI / 4096, rates="diff"))
    return d, recs, card()


@machine(63, "healthy")
def m63(rng):
    """Three-joint direct-drive arm, coloured noise, torque samples jitter by a third of a sample."""
    d = arm_yaml(
        "three-joint direct-drive arm",
        [(0.5, 0.1, 9.0, 0.24, 0.22, 0.03), (0.4, 0.08, 4.5, 0.19, 0.07, 0.03), (0.2, 0.05, 1.1, 0.09, 0.005, 0.03)],
        g=G,
    )
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(8):
        q = (
            picks(rng, dt, 3, (0.0, -1.5, -1.2), (1.7, 1.5, 1.2), (0.7, 2.0), 0.3)
            if k % 2
            else multisine(14, dt, [0.6, 0.8, 1.0], 0.1, 1.0, 6, rng, (0.9, -0.4, 0.2))
        )
        *_, K = motion_of(a, q, dt)
        recs.append(record(dt, 200, q, rigid(a, K), rng, sd=(0.8, 0.3, 0.04), ar=0.8, jitter=0.3, rates="noisy"))
    return d, recs, card()


@machine(64, "healthy")
def m64(rng):
    """Free pendulum on an air bearing, no damping that counts, encoder of 4096 steps, masses 5 %."""
    d = pendulum("free pendulum on an air bearing", 0.4, 0.6, 0.3, 0.008, 0.05)
    a = Arm(d, rng)
    recs = [
        record(1e-3, 200, free_pendulum(a, s, T, 1e-3), np.zeros((int(T * 1000) + 1, 1)), rng, qq=2 * PI / 4096)
        for s, T in ((2.2, 20), (-1.7, 8), (1.2, 30), (-0.8, 12), (0.5, 6))
    ]
    return d, recs, card()


@machine(70, "healthy")
def m70(rng):
    """Industrial two-joint arm; Coulomb and viscous friction declared with known_to 0.15 and true within it."""
    fc, fv = (9.0, 5.5), (8.0, 4.2)
    d = arm_yaml(
        "industrial arm whose friction is on the data sheet",
        INDUSTRIAL,
        g=G,
        friction=[{"coulomb_Nm": fc[j], "viscous_Nm_s": fv[j], "known_to": 0.15} for j in range(2)],
    )
    a = Arm(d, rng)
    k1 = 1 + 0.15 * np.clip(rng.normal(size=4), -1, 1)
    recs, dt = [], 1e-3
    for k in range(9):
        q = (
            picks(rng, dt, 2, (-0.4, -1.8), (1.9, 1.8), (0.7, 2.4), 0.25)
            if k % 2
            else multisine(14, dt, [0.8, 1.0], 0.1, 0.8, 6, rng, (0.8, -0.5))
        )
        dq, _, K = motion_of(a, q, dt)
        tau = rigid(a, K)
        for j in range(2):
            tau[:, j] += lugre(dq[:, j], dt, fc[j] * k1[j], Fv=fv[j] * k1[2 + j], z0=4e-4)
        recs.append(record(dt, 250, q, tau, rng, sd=(1.5, 0.8), ar=0.4, tq=0.12, rates="noisy"))
    return d, recs, card()
