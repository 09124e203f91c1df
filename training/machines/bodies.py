"""Arms in a tank, machines 24 to 31: seals, loads at the tip, neighbours of a link, viscous fluids."""

import math

import numpy as np
from arms import ONE, PI, TWO, Arm, arm_yaml, point_mass
from cards import card, hidden, machine
from drives import lugre
from logger import record
from motions import multisine, ramp, slews
from scipy.signal import fftconvolve
from water import tank


@machine(24, "water")
def m24(rng):
    """One-link tank arm, shaft through a tight lip seal (LuGre)."""
    d = arm_yaml("arm with a tight lip seal", ONE, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(9):
        q = slews(rng, dt) if k % 2 else multisine(18, dt, [0.9], 0.06, 0.5, 6, rng)
        dq, _, _, R, dr, am = tank(a, q, dt, [1.1], [0.9], S=12)
        recs.append(
            record(dt, 200, q, (R + dr + am)[:, 0] + lugre(dq[:, 0], dt, 0.45, 0.52, vs=0.02, z0=2e-3), rng, sd=0.12, rates="noisy")
        )
    facts = card([hidden("coulomb_friction", 1, partial=["stribeck_friction"], coulomb=(0.45, "N m"))], tolerated=["stribeck_friction"])
    return d, recs, facts


@machine(25, "water")
def m25(rng):
    """Two-link arm; the user's simulation (tau*_sim_Nm) has drag with Cd 1.1 and no added mass."""
    d = arm_yaml("two-link arm beside a drag-only simulation", TWO, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(8):
        q = slews(rng, dt, 2, (-1.4, -1.4), (1.4, 1.4)) if k % 2 else multisine(16, dt, [1.0, 1.2], 0.1, 0.8, 6, rng)
        *_, R, dr, am = tank(a, q, dt, [1.08, 1.08], [0.9, 0.82])
        *_, R0, d0, _ = tank(Arm(d, rng, 0.0), q, dt, [1.1, 1.1], [0.0, 0.0])
        recs.append(record(dt, 100, q, R + dr + am, rng, sd=(0.2, 0.05), sim=R0 + d0, rates="noisy"))
    facts = card(
        [hidden("added_mass", cm=(0.88, "1"))],
        note="run with --baseline column; against `constant` this campaign is healthy",
        baseline="column",
    )
    return d, recs, facts


@machine(26, "water")
def m26(rng):
    """Two-link tank arm; 0.9 kg at the tip not in arm.yaml (horizontal plane: inertia only)."""
    d = arm_yaml("two-link arm with a camera housing full of water", TWO, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(10):
        q = slews(rng, dt, 2, (-1.4, -2.2), (1.4, 2.2), moves=(0.5, 1.5)) if k % 2 else multisine(16, dt, [1.0, 1.6], 0.1, 1.0, 7, rng)
        *_, K, R, dr, am = tank(a, q, dt, [1.05, 1.05], [0.9, 0.85])
        recs.append(record(dt, 100, q, R + dr + am + point_mass(a, K, 0.9), rng, sd=(0.3, 0.08), acc=k % 2 == 0, rates="noisy"))
    facts = card(
        [hidden("payload_mass", partial=["rotor_inertia"], mass=(0.9, "kg"))],
        note="a free Cm a link takes part of it: the split of inertia over q2 tells; rotor inertia at both joints is half",
    )
    return d, recs, facts


@machine(27, "water")
def m27(rng):
    """Towed and swung arm; a cable bundle trails from its tip (Cd A 0.016 m2, along the whole velocity)."""
    d = arm_yaml("towed and swung arm trailing a cable", [(0.7, 0.06, 2.4, 0.35, 0.11, 0.02)], rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(12):
        T = 16
        u0 = ramp(T, dt, (0.0, 0.3, 0.5, 0.7, -0.4, 0.9)[k % 6])
        q = multisine(T, dt, [0.9 if k % 6 == 0 else 0.4], 0.08, 0.5, 6, rng, rng.uniform(-0.6, 0.6))
        *_, R, dr, am = tank(a, q, dt, [1.1], [0.9], u0=u0, tip_cda=0.016)
        recs.append(record(dt, 100, q, (R + dr + am)[:, 0], rng, sd=0.15, u0=u0, rates="noisy"))
    return d, recs, card([hidden("tip_drag", partial=["drag_form"], cda=(0.016, "m2"))])


@machine(28, "water")
def m28(rng):
    """Two-link arm; folded beyond 1.6 rad, link 2 stands in link 1's wake: its Cd falls by 70 %."""
    d = arm_yaml("two-link arm that folds", TWO, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(12):
        q = (
            slews(rng, dt, 2, (-1.2, -2.8), (1.2, 2.8), moves=(0.6, 2.0), K=11)
            if k % 2
            else multisine(20, dt, [1.0, 2.6], 0.06, 0.5, 7, rng)
        )
        fold = 1 - 0.7 / (1 + np.exp(-(np.abs(q[:, 1]) - 1.6) / 0.18))
        *_, R, dr, am = tank(a, q, dt, [1.1, 1.1], [0.9, 0.9], mult=lambda i, x, w, fold=fold: ((fold[:, None] if i == 1 else 1.0), 1.0))
        recs.append(record(dt, 100, q, R + dr + am, rng, sd=(0.2, 0.05), rates="noisy"))
    return d, recs, card([hidden("link_interference", 2, depth=(0.7, "1"))])


def wall(arm, q):
    """Return the factors on Cd and Cm in front of a wall 0.1 m beyond the tip at q = 0."""

    def mult(i, x, w):
        gap = arm.L[0] + 0.10 - x * np.cos(q[:, :1])
        f = np.exp(-gap / (1.6 * arm.D[0]))
        return 1 + 1.3 * f, 1 + 1.0 * f

    return mult


@machine(29, "water")
def m29(rng):
    """One-link arm whose tip passes 5 cm in front of a wall at q = 0."""
    d = arm_yaml("arm sweeping past the tank wall", [(0.7, 0.09, 3.2, 0.34, 0.14, 0.02)], rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(10):
        q = slews(rng, dt, 1, -1.6, 1.6, K=11) if k % 2 else multisine(20, dt, [1.4], 0.06, 0.45, 6, rng)
        *_, R, dr, am = tank(a, q, dt, [1.05], [0.85], mult=wall(a, q))
        recs.append(record(dt, 100, q, (R + dr + am)[:, 0], rng, sd=0.2, rates="noisy"))
    return d, recs, card([hidden("wall_proximity")])


@machine(30, "water")
def m30(rng):
    """Towed two-link arm; oil-filled elbow drive drags in proportion to its own speed."""
    d = arm_yaml("two-link arm with an oil-filled elbow", TWO, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(10):
        T = 18
        u0 = ramp(T, dt, (0, 0.25, 0, -0.4, 0.5)[k % 5])
        q = multisine(T, dt, [0.8, 1.3], 0.06, 0.6, 6, rng, (0.0, rng.uniform(-0.5, 0.5)))
        dq, _, _, R, dr, am = tank(a, q, dt, [1.1, 1.0], [0.9, 0.9], u0=u0)
        tau = R + dr + am
        tau[:, 1] += 0.42 * dq[:, 1]
        recs.append(record(dt, 100, q, tau, rng, sd=(0.25, 0.06), u0=u0, qq=2 * PI / 8192, rates="diff" if k % 2 else None))
    return d, recs, card([hidden("viscous_friction", 2, viscous=(0.42, "N m s/rad"))])


def half_derivative(a, dt):
    """Return the half derivative (n,) of the rate whose derivative is a (n,), exact where a is constant between samples."""
    k = np.arange(len(a))
    w = 2 / math.sqrt(PI) * (np.sqrt((k + 1) * dt) - np.sqrt(k * dt))
    return fftconvolve(a, w)[: len(a)]


@machine(31, "water")
def m31(rng):
    """Thin rod in glycerine-water (nu 4e-4): viscous boundary-layer memory of an oscillating cylinder (Stokes-Basset)."""
    rho, nu = 1220.0, 4e-4
    d = arm_yaml("thin rod swinging in glycerine-water", [(0.4, 0.03, 0.55, 0.2, 0.0075, 0.02)], rho=rho, nu=nu)
    a = Arm(d, rng)
    recs, dt = [], 2e-3
    coef = 2 * PI * rho * a.D[0] * math.sqrt(nu) * a.L[0] ** 3 / 3
    for k in range(10):
        q = (
            slews(rng, dt, 1, -0.5, 0.5, K=10, moves=(0.4, 1.5), dwell=1.2)
            if k % 2
            else multisine(16, dt, [rng.uniform(0.1, 0.5)], 0.15, 2.5, 9, rng)
        )
        _, ddq, _, R, dr, am = tank(a, q, dt, [1.3], [1.0])
        tau = (R + dr + am)[:, 0] + coef * half_derivative(ddq[:, 0], dt)
        recs.append(record(dt, 125, q, tau, rng, sd=0.006, acc=True, rates="noisy"))
    facts = card(
        [hidden("history_force", partial=["viscous_friction", "drag_form", "flow_memory"], coefficient=(coef, "N m s^1.5"))],
        note="in a narrow band it is linear damping plus inertia: those names are half",
    )
    return d, recs, facts
