"""Arms in a tank, machines 16 to 23: hoses, wakes, currents, waves, a tilted frame."""

import math

import numpy as np
from arms import ONE, PI, TWO, Arm, arm_yaml
from cards import card, hidden, machine
from drives import lag1
from logger import record
from motions import multisine, ramp, slews, zigzag
from water import developing, drag_crisis, regular_wave, shedding, tank


@machine(16, "water")
def m16(rng):
    """One-link tank arm with a hose that stiffens a little with its bend."""
    d = arm_yaml("swinging cylinder with a supply hose", ONE, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2e-3
    for k in range(10):
        q = slews(rng, dt) if k % 2 else multisine(18, dt, [0.9], 0.06, 0.6, 6, rng, rng.uniform(-0.3, 0.3))
        *_, R, dr, am = tank(a, q, dt, [1.05], [0.85])
        x = q[:, 0] - 0.25
        hose = 1.1 * x + 0.25 * x**3
        recs.append(record(dt, 100, q, (R + dr + am)[:, 0] + hose, rng, sd=0.12, rates="noisy"))
    return d, recs, card([hidden("umbilical_stiffness", 1, stiffness=(1.2, "N m/rad"), rest=(0.25, "rad"))])


@machine(17, "water")
def m17(rng):
    """One-link arm slewing from rest in still water; Cd overshoots at 4 diameters, Cm dips."""
    d = arm_yaml("cylinder slewing from rest", ONE, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(12):
        q = zigzag(rng, dt, 0.4, 2.2, (0.5, 1.8)) if k < 8 else multisine(15, dt, [rng.uniform(0.5, 1.2)], 0.1, 0.6, 5, rng)
        *_, R, dr, am = tank(a, q, dt, [1.1], [1.0], mult=developing(a, dt))
        recs.append(record(dt, 100, q, (R + dr + am)[:, 0], rng, sd=0.15, rates="noisy", acc=k % 3 == 0))
    facts = card(
        [hidden("wake_development", partial=["wake_reentry", "flow_memory"])],
        note="reversals included; named memory kinds are half: the honest reading is s/D",
    )
    return d, recs, facts


@machine(18, "water")
def m18(rng):
    """Boom whose drag lags the motion: two-exponential wake response, mean lag 0.25 s."""
    d = arm_yaml("plate-like boom", [(0.7, 0.09, 3.2, 0.34, 0.14, 0.02)], rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(10):
        q = multisine(20, dt, [rng.uniform(0.5, 1.0)], 0.08, 0.8, 7, rng) if k % 2 else slews(rng, dt)
        *_, R, dr, am = tank(a, q, dt, [1.2], [0.8])
        D = dr[:, 0]
        lagged = 0.1 * D + 0.6 * lag1(D, 0.32, dt) + 0.3 * lag1(D, 0.18, dt)  # two-exponential wake build-up
        recs.append(record(dt, 100, q, (R + am)[:, 0] + lagged, rng, sd=0.2, ar=0.4))
    return d, recs, card([hidden("flow_memory", partial=["wake_development", "wake_reentry"], time=(0.25, "s"))])


@machine(19, "water")
def m19(rng):
    """Mast towed through the drag crisis (Re 4e4 to 5e5, Wieselsberger's curve strip by strip)."""
    d = arm_yaml("fast towed and swung mast", [(1.0, 0.16, 14.0, 0.5, 1.3, 0.02)], rho=999.0, nu=1.1e-6)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(12):
        T = 16
        U = [0.3, 0.6, 0.9, 1.2, 1.6, 2.0, 2.5, 3.0][k] if k < 8 else 0.0
        u0 = ramp(T, dt, U, up=2.5, down=2.5)
        q = multisine(T, dt, [0.15 if U else 1.1], 0.1, 0.45, 5, rng, rng.uniform(-0.4, 0.4))
        *_, R, dr, am = tank(a, q, dt, [1.0], [0.9], u0=u0, mult=drag_crisis(a))
        tau = (R + dr + am)[:, 0]
        recs.append(record(dt, 100, q, tau, rng, sd=1.2 + 0.01 * np.abs(tau).max(), u0=u0, rates="noisy"))
    return d, recs, card([hidden("reynolds_drag", partial=["drag_form"])])


@machine(20, "water")
def m20(rng):
    """Two-link arm; the basin's pump left on: steady current 0.12 m/s at 35 degrees."""
    d = arm_yaml("two-link arm in a flume that is not still", TWO, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(10):
        q = slews(rng, dt, 2, (-1.5, -1.5), (1.5, 1.5)) if k % 2 else multisine(18, dt, [1.2, 1.2], 0.06, 0.5, 6, rng)
        *_, R, dr, am = tank(a, q, dt, [1.1, 1.05], [0.9, 0.9], V=(0.10, 0.07))
        recs.append(record(dt, 100, q, R + dr + am, rng, sd=(0.15, 0.04), rates="noisy"))
    return d, recs, card([hidden("ambient_current", speed=(0.122, "m/s"), direction=(0.611, "rad"))])


@machine(21, "water")
def m21(rng):
    """One-link arm in a basin with a regular wave of 0.62 Hz (orbital speed 0.075 m/s), clock_s given."""
    d = arm_yaml("arm under a regular wave", ONE, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    om, amp, be = 2 * PI * 0.62, 0.075, 0.5
    for k in range(10):
        q = slews(rng, dt, K=11) if k % 2 else multisine(24, dt, [0.9], 0.05, 0.35, 5, rng)
        clock = 100.0 * k + 7.3
        wave = regular_wave(np.arange(len(q)) * dt + clock, amp, om, be)
        *_, R, dr, am = tank(a, q, dt, [1.1], [0.85], wave=wave)
        recs.append(record(dt, 80, q, (R + dr + am)[:, 0], rng, sd=0.12, clock=clock))
    return d, recs, card([hidden("wave_orbital", amplitude=(0.075, "m/s"), frequency=(0.62, "Hz"))])


@machine(22, "water")
def m22(rng):
    """Cylinder towed at ten speeds; in-line force at twice St U/D (St 0.2), phase wanders."""
    d = arm_yaml("towed cylinder that sheds", [(0.9, 0.08, 5.0, 0.45, 0.35, 0.02)], rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2e-3
    for k in range(10):
        T = 20
        U = 0.35 + 0.09 * k
        u0 = ramp(T, dt, U, up=1.5, down=1.5)
        q = np.full((len(u0), 1), rng.uniform(-0.15, 0.15)) if k % 3 else multisine(T, dt, [0.2], 0.05, 0.2, 4, rng)
        jit = np.cumsum(rng.normal(size=len(u0))) * math.sqrt(dt) * 0.5
        shed = shedding(a, dt, 0.2, 0.22, jit, rng.uniform(0, 6.28))
        *_, R, dr, am = tank(a, q, dt, [1.05], [0.9], u0=u0, shed=shed)
        tau = (R + dr + am)[:, 0]
        recs.append(record(dt, 125, q, tau, rng, sd=0.15 + 0.008 * np.abs(tau).max(), u0=u0))
    return d, recs, card([hidden("vortex_shedding", strouhal=(0.2, "1"), amplitude=(0.22, "1"))])


@machine(23, "water")
def m23(rng):
    """Two-link arm, frame tilted: weight minus buoyancy is felt as cos of each link's direction from 0.8 rad."""
    d = arm_yaml("two-link arm on a tilted frame", TWO, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(10):
        q = slews(rng, dt, 2, (-2.0, -1.5), (2.0, 1.5), moves=(1.0, 3.0)) if k % 2 else multisine(18, dt, [1.6, 1.2], 0.05, 0.4, 6, rng)
        *_, R, dr, am = tank(a, q, dt, [1.1, 1.05], [0.9, 0.9])
        p1, p2 = q[:, 0] - 0.8, q[:, 0] + q[:, 1] - 0.8
        tau = R + dr + am
        tau[:, 1] += 0.30 * np.cos(p2)
        tau[:, 0] += 0.30 * np.cos(p2) + 0.62 * np.cos(p1)
        recs.append(record(dt, 100, q, tau, rng, sd=(0.1, 0.03)))
    return d, recs, card([hidden("buoyancy_tilt", link1=(0.62, "N m"), link2=(0.30, "N m"))])
