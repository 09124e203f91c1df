"""Dry machines 8 to 15: shafts, screws, belts, gears, loads and torque sensors."""

import numpy as np
import pandas as pd
from arms import PI, Arm, G, arm_yaml, deriv, motion_of, pendulum, point_mass, rigid
from cards import card, hidden, machine
from drives import compliant, lugre
from logger import record
from motions import multisine, path, picks


@machine(8, "dry")
def m08(rng):
    """Shaft without arms, steady table of 34 speeds in one direction: lip seals and grease."""
    d = arm_yaml("shaft of a test bed in bearings and lip seals", [(0.5, 0.1, 0.0, 0.0, 0.0, 0.2)])
    w = np.sort(np.r_[np.linspace(0.5, 24, 28), rng.uniform(1, 24, 6)])
    fr = 0.62 + 0.045 * w
    rows = pd.DataFrame(
        {
            "run": [f"run{i:02d}" for i in range(len(w))],
            "q1_rad": 0.0,
            "dq1_rad_s": w,
            "u0_m_s": 0.0,
            "tau1_Nm": fr * (1 + 0.012 * rng.normal(size=len(w))) + 0.008 * rng.normal(size=len(w)),
            "tau1_std_Nm": 0.015,
        }
    )
    facts = card(
        [
            hidden("viscous_friction", 1, viscous=(0.045, "N m s/rad")),
            hidden("coulomb_friction", 1, accept=["torque_bias", "buoyancy_tilt"], coulomb=(0.62, "N m")),
        ],
        note="one direction: Coulomb = offset",
    )
    return d, [], facts, rows


@machine(9, "dry")
def m09(rng):
    """Ball-screw axis with preloaded nut and wipers; force from motor current."""
    d = arm_yaml("ball-screw axis", [(0.8, 0.05, 21.0, 0.0, 0.0, 0.02)], joints=[{"type": "prismatic"}])
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(8):
        q = (
            path(rng.uniform(0.05, 0.75, 9), rng.uniform(0.25, 1.2, 8), 0.2, dt, "trapezoid")
            if k % 2
            else multisine(10, dt, [rng.uniform(0.05, 0.3)], 0.2, 2.0, 6, rng, 0.4)
        )
        dq, ddq = deriv(q, dt)
        F = a.m[0] * ddq[:, 0] + lugre(dq[:, 0], dt, 26.0, 29.0, vs=0.004, Fv=55.0, z0=2e-5)
        recs.append(record(dt, 500, q, F, rng, sd=5.0, tq=1.2, qq=2e-6, prism=True, rates="diff" if k < 4 else None))
    facts = card(
        [
            hidden("coulomb_friction", 1, partial=["stribeck_friction"], coulomb=(26.0, "N")),
            hidden("viscous_friction", 1, viscous=(55.0, "N s/m")),
        ],
        tolerated=["stribeck_friction"],
    )
    return d, recs, facts


@machine(10, "dry")
def m10(rng):
    """Upright arm behind a soft toothed belt (5 Hz with the drive held), multisines to 3.6 Hz."""
    d = pendulum("arm on a toothed belt", 0.5, 1.6, 0.27, 0.04, 0.02, 0.04)
    a = Arm(d, rng)
    recs, dt = [], 5e-4
    for _ in range(8):
        th = multisine(15, dt, [rng.uniform(0.25, 0.5)], 0.2, 3.6, 10, rng, rng.uniform(-1.8, -0.8))
        tau = compliant(a, th[:, 0], dt, 160.0, 0.35)
        recs.append(record(dt, 400, th, tau, rng, sd=0.12, ar=0.3, qq=2 * PI / 40000))
    facts = card(
        [hidden("joint_elasticity", 1, stiffness=(160.0, "N m/rad"), damping=(0.35, "N m s/rad"))],
        note="static sag mgc/k = 1.5 deg; the resonance amplifies inertia torque by 1/(1-(f/fn)^2)",
    )
    return d, recs, facts


@machine(11, "dry")
def m11(rng):
    """Driven pendulum behind a worn spur gear: gap of 0.03 rad, stiff flanks, torque on the drive side."""
    d = pendulum("pendulum behind a worn spur gear", 0.45, 1.4, 0.3, 0.02, 0.03, 0.04)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-4
    for k in range(8):
        th = multisine(14, dt, [rng.uniform(0.5, 1.2)], 0.15, 1.0, 6, rng, -PI / 2)
        tau = compliant(a, th[:, 0], dt, 900.0, 7.0, gap=0.03)
        recs.append(record(dt, 500, th, tau, rng, sd=0.04, rates="noisy" if k % 2 else None))
    facts = card(
        [hidden("backlash", 1, partial=["joint_elasticity"], gap=(0.03, "rad"))],
        note="elasticity alone is half: both are compliant drives",
    )
    return d, recs, facts


@machine(12, "dry")
def m12(rng):
    """Horizontal wrist; gear ripple of 16 periods a turn with a second harmonic."""
    d = arm_yaml("harmonic-drive wrist", [(0.4, 0.06, 2.2, 0.2, 0.03, 0.03)])
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(8):
        q = (
            path(np.cumsum(rng.uniform(-2.0, 2.0, 8)), rng.uniform(1.0, 4.0, 7), 0.3, dt)
            if k % 2
            else multisine(18, dt, [1.6], 0.06, 0.8, 6, rng, rng.uniform(-1, 1))
        )
        *_, K = motion_of(a, q, dt)
        x = q[:, 0]
        tau = rigid(a, K)[:, 0] + 0.055 * np.sin(16 * x + 0.7) + 0.012 * np.sin(32 * x + 1.9)
        recs.append(record(dt, 250, q, tau, rng, sd=0.03, qq=2 * PI / 2**17, rates="noisy"))
    return d, recs, card([hidden("torque_ripple", 1, amplitude=(0.055, "N m"), periods=(16.0, "1/rev"))])


@machine(13, "dry")
def m13(rng):
    """Two-joint upright arm, gripper of 0.33 kg at the tip forgotten in arm.yaml."""
    d = arm_yaml("two-joint arm with a gripper left on", [(0.4, 0.05, 2.1, 0.2, 0.03, 0.03), (0.35, 0.04, 1.2, 0.17, 0.013, 0.03)], g=G)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(8):
        q = (
            picks(rng, dt, 2, (-1.0, -1.8), (2.0, 1.8), (0.6, 1.6), 0.3)
            if k % 2
            else multisine(14, dt, [1.0, 1.2], 0.1, 1.0, 6, rng, (0.4, 0))
        )
        *_, K = motion_of(a, q, dt)
        tau = rigid(a, K) + point_mass(a, K, 0.33)
        recs.append(record(dt, 200, q, tau, rng, sd=(0.35, 0.12), ar=0.6))
    return d, recs, card([hidden("payload_mass", mass=(0.33, "kg"))])


@machine(14, "dry")
def m14(rng):
    """Two-joint upright arm, wrong scale (1.13) of the torque flange at joint 2."""
    d = arm_yaml("two-joint arm, strain-gauge flanges", [(0.5, 0.06, 4.0, 0.24, 0.09, 0.01), (0.4, 0.05, 2.0, 0.19, 0.03, 0.01)], g=G)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(8):
        q = (
            picks(rng, dt, 2, (-1.0, -1.5), (1.8, 1.5), (0.7, 1.8), 0.3)
            if k % 2
            else multisine(14, dt, [1.0, 1.0], 0.1, 0.9, 6, rng, (0.4, 0.2))
        )
        *_, K = motion_of(a, q, dt)
        tau = rigid(a, K) * np.array([1.0, 1.13])
        recs.append(record(dt, 200, q, tau, rng, sd=(0.3, 0.08), acc=k < 4, rates="noisy" if k < 4 else None))
    facts = card(
        [hidden("torque_gain", 2, error=(0.13, "1"))],
        note="joint 1 feels the true masses of link 2; known_to 0.01 forbids a heavier link 2",
    )
    return d, recs, facts


@machine(15, "dry")
def m15(rng):
    """Fast single arm; current read over a slow bus: 7 ms dead time and a 6 ms filter."""
    d = pendulum("fast scanner arm", 0.3, 0.5, 0.16, 0.005, 0.02, 0.03)
    a = Arm(d, rng)
    recs, dt = [], 5e-4
    for _ in range(9):
        q = multisine(10, dt, [rng.uniform(0.3, 0.6)], 0.4, 4.5, 10, rng, rng.uniform(-2.0, -0.9))
        *_, K = motion_of(a, q, dt)
        recs.append(record(dt, 500, q, rigid(a, K), rng, sd=0.035, tq=0.004, delay=0.007, lag=0.006))
    return d, recs, card([hidden("sensor_timing", lag=(0.013, "s"), delay=(0.007, "s"), low_pass=(0.006, "s"))])
