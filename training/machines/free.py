"""Bodies that roll or swing freely in water, machines 32 to 39: one link, whose weight acts at the metacentric height."""

import math

import numpy as np
from arms import PI, Arm, arm_yaml
from cards import card, hidden, machine
from drives import rk4
from logger import record

HULL = (0.30, 0.20, 60.0, 0.05, 1.25, 0.02)


def no_torque(*_):
    """Return no torque."""
    return 0.0


def swing(a, s0, T, dt, cd, cm, resist=no_torque, drive=no_torque):
    """Return angles and torques (n, 1) of a body of one link that swings in water from s0 (rad) off its rest.

    resist(q, v) is a further torque against the motion, drive(t) the torque that is applied, N m.
    """
    J = a.I[0] + a.m[0] * a.c[0] ** 2 + cm * a.rho * PI / 4 * a.D[0] ** 2 * a.L[0] ** 3 / 3
    W, b2 = a.m[0] * a.g * a.c[0], cd * a.rho * a.D[0] * a.L[0] ** 4 / 8

    def f(t, y):
        q, v = y
        return v, (drive(t) - W * math.cos(q) - b2 * v * abs(v) - resist(q, v)) / J

    y = rk4(f, (-PI / 2 + s0, 0.0), T, dt)
    t = np.arange(len(y)) * dt
    return y[:, :1], np.array([drive(x) for x in t])[:, None]


def decays(rng, a, angles, T, fs, cd, cm, resist=no_torque, qsd=4e-4, rates=None, dt=2e-3):
    """Return a recording of the decay from each of the angles (rad)."""
    out = []
    for s in angles:
        q, tau = swing(a, s, T, dt, cd, cm, resist)
        out.append(record(dt, fs, q, tau, rng, qsd=qsd, rates=rates))
    return out


def sine(amplitude, f):
    """Return a drive's torque (N m) over time, of f Hz, that sets in within 4 s."""
    return lambda t: amplitude * math.sin(2 * PI * f * t) * min(1, t / 4)


@machine(32, "free")
def m32(rng):
    """Ship model under way, roll decays from six heels; lift and wave damping, linear."""
    d = arm_yaml("ferry model, roll decay under way", [HULL], rho=1000.0, g=9.81)
    a = Arm(d, rng)
    recs = decays(rng, a, (0.35, -0.3, 0.22, -0.16, 0.12, 0.08), 18, 50, 0.05, 0.8, lambda q, v: 0.42 * v)
    facts = card([hidden("viscous_friction", 1, accept=["drag_form"], viscous=(0.42, "N m s/rad"))])
    return d, recs, facts


@machine(33, "free")
def m33(rng):
    """Barge model at rest, decays from seven heels; linear (waves) beside quadratic (bilge keels) damping."""
    d = arm_yaml("barge with bilge keels", [(0.35, 0.22, 80.0, 0.06, 2.1, 0.02)], rho=1000.0, g=9.81)
    a = Arm(d, rng)
    recs = decays(rng, a, (0.40, 0.32, -0.25, 0.18, -0.12, 0.07, 0.05), 20, 100, 1.3, 1.1, lambda q, v: 0.5 * v, qsd=3e-4)
    facts = card([hidden("viscous_friction", 1, accept=["drag_form"], viscous=(0.5, "N m s/rad"))])
    return d, recs, facts


@machine(34, "free")
def m34(rng):
    """Pontoon with sharp keels, decays: quadratic damping and added inertia only (the baseline's own law)."""
    d = arm_yaml("flat-bottomed pontoon with sharp keels", [(0.35, 0.22, 80.0, 0.06, 2.1, 0.02)], rho=1000.0, g=9.81)
    a = Arm(d, rng)
    return d, decays(rng, a, (0.45, -0.36, 0.28, -0.2, 0.14), 20, 100, 1.9, 1.0, qsd=3e-4), card()


@machine(35, "free")
def m35(rng):
    """Ballasted rod hanging in water on plain bearings (dry friction smooth below 0.01 rad/s), decays."""
    d = arm_yaml("ballasted pendulum in water on plain bearings", [(0.5, 0.06, 3.5, 0.34, 0.06, 0.02)], rho=998.0, g=9.81)
    a = Arm(d, rng)
    recs = decays(
        rng,
        a,
        (1.0, -0.8, 0.6, 0.45, -0.3, 0.2),
        14,
        200,
        1.1,
        0.9,
        lambda q, v: 0.13 * math.tanh(v / 0.01),
        qsd=5e-4,
        rates="diff",
        dt=5e-4,
    )
    return d, recs, card([hidden("coulomb_friction", 1, coulomb=(0.13, "N m"))], tolerated=["stribeck_friction"])


@machine(36, "free")
def m36(rng):
    """Ship model, roll forced at eight frequencies by an internal drive whose torque is known; linear beside quadratic damping."""
    d = arm_yaml("forced roll by a moving mass", [HULL], rho=1000.0, g=9.81)
    a = Arm(d, rng)
    recs, dt = [], 2e-3
    for k, f in enumerate((0.4, 0.5, 0.6, 0.66, 0.72, 0.8, 0.95, 1.1)):
        amp = (0.8, 1.6)[k % 2] * (1 if 0.55 < f < 0.85 else 2.0)
        q, tau = swing(a, 0.01, 30, dt, 0.8, 0.8, lambda q, v: 0.40 * v, sine(amp, f))
        recs.append(record(dt, 50, q, tau, rng, sd=0.02, qsd=4e-4, rates="noisy"))
    return d, recs, card([hidden("viscous_friction", 1, accept=["drag_form"], viscous=(0.40, "N m s/rad"))])


@machine(37, "free")
def m37(rng):
    """Ship model forced in roll and left to decay; the heel sensor reads 0.055 rad too much."""
    d = arm_yaml("forced roll, heel sensor bolted on askew", [HULL], rho=1000.0, g=9.81)
    a = Arm(d, rng)
    recs, dt = [], 2e-3
    for k, f in enumerate((0.35, 0.5, 0.6, 0.7, 0.8, 1.0, 0.0, 0.0)):
        amp = 0.0 if f == 0 else (1.2, 2.2)[k % 2]
        q, tau = swing(a, 0.4 if f == 0 else 0.0, 24, dt, 1.1, 0.8, drive=sine(amp, f))
        recs.append(record(dt, 50, q + 0.055, tau, rng, sd=0.02 * (amp > 0), qsd=4e-4))
    facts = card(
        [hidden("encoder_offset", 1, accept=["torque_bias", "buoyancy_tilt"], offset=(0.055, "rad"))],
        note="at small heel the weight's torque at an offset is a constant torque: bias and tilt are equivalent",
    )
    return d, recs, facts


@machine(38, "free")
def m38(rng):
    """Rod hanging in water, stiff instrument cable over the pivot: spring about 0.1 rad, decays to 75 degrees."""
    d = arm_yaml("pendulum in water with an instrument cable", [(0.5, 0.06, 3.5, 0.34, 0.06, 0.02)], rho=998.0, g=9.81)
    a = Arm(d, rng)
    recs = decays(rng, a, (1.3, -1.1, 0.9, -0.7, 0.5, 0.3), 12, 200, 1.1, 0.9, lambda q, v: 2.3 * (q + PI / 2 - 0.1), qsd=4e-4)
    facts = card(
        [hidden("umbilical_stiffness", 1, partial=["buoyancy_tilt"], stiffness=(2.3, "N m/rad"))],
        note="spring is linear in q, weight goes as sin: 20 % of the weight, told apart at large amplitude",
    )
    return d, recs, facts


@machine(39, "free")
def m39(rng):
    """Rod hanging in water, lead collar of 0.4 kg at the tip not in arm.yaml, decays."""
    d = arm_yaml("pendulum in water, lead collar forgotten", [(0.5, 0.06, 3.0, 0.30, 0.06, 0.02)], rho=998.0, g=9.81)
    a = Arm(d, rng)
    m, c, M, L = a.m[0], a.c[0], 0.4, a.L[0]
    a.m[0], a.c[0] = m + M, (m * c + M * L) / (m + M)
    a.I[0] = a.I[0] + m * (c - a.c[0]) ** 2 + M * (L - a.c[0]) ** 2
    recs = decays(rng, a, (1.2, -1.0, 0.8, -0.6, 0.4, 0.25), 12, 200, 1.1, 0.9, qsd=4e-4)
    facts = card(
        [hidden("payload_mass", accept=["buoyancy_tilt"], mass=(0.4, "kg"))],
        note="Cm is free, so only the weight shows: tilt (weight less buoyancy) is equivalent",
    )
    return d, recs, facts
