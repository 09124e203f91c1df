"""Healthy machines in a tank with unpleasant records: 65 to 69, and 71."""

import numpy as np
import pandas as pd
from arms import ONE, PI, TWO, Arm, arm_yaml
from cards import card, machine
from logger import record
from motions import multisine, ramp, slews
from water import tank


@machine(65, "healthy")
def m65(rng):
    """One-link tank arm with constant Cd and Cm; coloured noise that differs by five between recordings."""
    d = arm_yaml("swinging cylinder, tired strain bridge", ONE, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(12):
        q = slews(rng, dt) if k % 2 else multisine(rng.uniform(8, 30), dt, [0.9], 0.06, 0.6, 6, rng)
        *_, R, dr, am = tank(a, q, dt, [1.05], [0.85])
        recs.append(record(dt, 100, q, (R + dr + am)[:, 0], rng, sd=0.06 * 5 ** rng.uniform(0, 1), ar=0.9, rates="noisy"))
    return d, recs, card()


@machine(66, "healthy")
def m66(rng):
    """Two-link tank arm; masses off by up to 10 % at known_to 6 %, encoders of 2048 steps, lagging rates."""
    d = arm_yaml("two-link tank arm, coarse encoders", [(*link[:5], 0.06) for link in TWO], rho=998.0)
    a = Arm(d, rng, 1.1)
    recs, dt = [], 2.5e-3
    for k in range(10):
        q = slews(rng, dt, 2, (-1.5, -1.5), (1.5, 1.5)) if k % 2 else multisine(18, dt, [1.2, 1.2], 0.06, 0.6, 6, rng)
        *_, R, dr, am = tank(a, q, dt, [1.0, 1.15], [0.9, 0.8])
        recs.append(record(dt, 100, q, R + dr + am, rng, sd=(0.25, 0.07), qq=2 * PI / 2048, rates="diff"))
    facts = card(
        tolerated=["sensor_timing"],
        note="the given rates lag the angles by about 15 ms; a timing finding would be half true, so it is not counted",
    )
    return d, recs, facts


@machine(67, "healthy")
def m67(rng):
    """Strut across the tow, steady table of 20 speeds; one Cd, 3 % scatter with some outliers."""
    d = arm_yaml("strut across the tow, steady table", [(1.0, 0.1, 0.0, 0.0, 0.0, 0.2)], rho=999.0)
    U = np.r_[np.linspace(0.2, 1.4, 16), 0.4, 0.7, 1.0, 1.3]
    tau = 0.5 * 999 * 0.1 * 1.02 * 0.5 * U**2
    tau = tau * (1 + 0.03 * rng.normal(size=len(U))) + 0.15 * rng.standard_t(3, len(U))
    rows = pd.DataFrame(
        {"run": [f"run{i:02d}" for i in range(len(U))], "q1_rad": 0.0, "dq1_rad_s": 0.0, "u0_m_s": U, "tau1_Nm": tau, "tau1_std_Nm": 0.3}
    )
    return d, [], card(), rows


@machine(68, "healthy")
def m68(rng):
    """Towed and swung arm; coloured noise 6 %, synchronisation jitter of 0.4 samples, lengths 8 to 30 s."""
    d = arm_yaml("towed and swung arm on a shaking carriage", [(0.7, 0.06, 2.4, 0.35, 0.11, 0.02)], rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(12):
        T = rng.uniform(8, 30)
        u0 = ramp(T, dt, (0.0, 0.3, 0.5, 0.7, -0.4, 0.9)[k % 6])
        q = multisine(T, dt, [0.9 if k % 6 == 0 else 0.4], 0.08, 0.5, 6, rng, rng.uniform(-0.6, 0.6))
        *_, R, dr, am = tank(a, q, dt, [1.1], [0.9], u0=u0)
        recs.append(record(dt, 100, q, (R + dr + am)[:, 0], rng, sd=0.25, ar=0.93, jitter=0.4, u0=u0))
    return d, recs, card()


@machine(69, "healthy")
def m69(rng):
    """Two-link tank arm, uneven sampling, heavy tails, lengths 6 to 40 s."""
    d = arm_yaml("two-link tank arm on a busy logger", TWO, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(9):
        q = (
            slews(rng, dt, 2, (-1.5, -1.5), (1.5, 1.5), K=int(rng.integers(5, 16)))
            if k % 2
            else multisine(rng.uniform(6, 40), dt, [1.2, 1.2], 0.06, 0.5, 6, rng)
        )
        *_, R, dr, am = tank(a, q, dt, [1.1, 1.05], [0.9, 0.9])
        recs.append(record(dt, 80, q, R + dr + am, rng, sd=np.array([0.3, 0.08]) * rng.uniform(0.4, 2.0), uneven=0.35, tails=True))
    return d, recs, card()


@machine(71, "healthy")
def m71(rng):
    """Two-link arm in a flume; the current differs from run to run and is measured (current_x_m_s, current_y_m_s)."""
    d = arm_yaml("two-link arm in a flume with a current meter", TWO, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(10):
        V = np.array([rng.uniform(-0.05, 0.2), rng.uniform(-0.05, 0.15)])
        q = slews(rng, dt, 2, (-1.5, -1.5), (1.5, 1.5)) if k % 2 else multisine(18, dt, [1.2, 1.2], 0.06, 0.5, 6, rng)
        *_, R, dr, am = tank(a, q, dt, [1.1, 1.05], [0.9, 0.9], V=V)
        df = record(dt, 100, q, R + dr + am, rng, sd=(0.25, 0.07), ar=0.5, std=(0.25, 0.07))
        df["current_x_m_s"], df["current_y_m_s"] = V[0], V[1]
        recs.append(df)
    return d, recs, card()
