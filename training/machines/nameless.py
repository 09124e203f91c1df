"""Machines 56 to 59, whose hidden effect had no name in the catalogue when they were written; that of 58 has one now."""

import math

import numpy as np
from arms import ONE, PI, Arm, arm_yaml, motion_of, pendulum, rigid
from cards import card, hidden, machine
from drives import lag1
from logger import record
from motions import multisine, path, slews
from water import tank


@machine(56, "nameless")
def m56(rng):
    """Upright arm with a loose slug of 0.12 kg that rattles 5 cm to and fro across its tube: blows after each turn."""
    d = pendulum("arm with a loose tool in its tube", 0.5, 1.8, 0.25, 0.04, 0.03, 0.05)
    a = Arm(d, rng)
    recs, dt = [], 5e-4
    ms, half, c, k = 0.12, 0.05, 0.25, 9e3  # slug of 0.12 kg free along 5 cm each way, across the motion
    for _ in range(9):
        q = multisine(14, dt, [rng.uniform(0.4, 0.9)], 0.2, 1.8, 8, rng, rng.uniform(-2.0, -1.1))
        _, ddq, K = motion_of(a, q, dt)
        base = -(c * ddq[:, 0] + a.g * np.cos(q[:, 0]))  # acceleration of the slug in the tube's frame
        x, v, F = 0.0, 0.0, []
        for b in base.tolist():
            f = -k * (abs(x) - half) * math.copysign(1, x) - 14.0 * v if abs(x) > half else -0.15 * v
            v += dt * (b + f / ms)
            x += dt * v
            F.append(f)
        tau = rigid(a, K)[:, 0] + c * lag1(np.array(F), 0.004, dt)
        recs.append(record(dt, 250, q, tau, rng, sd=0.06, rates="noisy"))
    return d, recs, card(nameless=True, note="backlash, payload and ripple are all false: a free mass with impacts of its own")


@machine(57, "nameless")
def m57(rng):
    """Horizontal table; three stray magnets make wells of unlike width and sign at three unlike angles."""
    d = arm_yaml("turntable with magnets left in the base", [(0.4, 0.06, 2.2, 0.2, 0.03, 0.03)])
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for j in range(9):
        q = path(rng.uniform(-2.0, 2.0, 9), rng.uniform(1.5, 4.0, 8), 0.3, dt) if j % 2 else multisine(18, dt, [2.0], 0.05, 0.5, 6, rng)
        *_, K = motion_of(a, q, dt)
        x = q[:, 0]
        det = sum(
            A0 * ((x - c) / w) * np.exp(-(((x - c) / w) ** 2)) for A0, c, w in ((0.28, -1.3, 0.07), (-0.16, 0.22, 0.16), (0.22, 0.95, 0.04))
        )
        recs.append(record(dt, 200, q, rigid(a, K)[:, 0] + det, rng, sd=0.02, qq=2 * PI / 2**16, rates="noisy"))
    return d, recs, card(nameless=True, note="not periodic in the angle, so torque_ripple is false; not a spring to a rest angle either")


@machine(58, "nameless")
def m58(rng):
    """Arm carrying an open trough: water sloshes at 1.15 Hz, hardening and breaking, rings after every stop."""
    d = arm_yaml("swinging open trough", [(0.6, 0.12, 5.0, 0.3, 0.18, 0.02)])
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for j in range(9):
        q = (
            multisine(20, dt, [rng.uniform(0.3, 0.8)], 0.15, 1.6, 9, rng)
            if j % 2
            else path(rng.uniform(-1, 1, (9, 1)), rng.uniform(0.6, 1.6, 8), 1.2, dt)
        )
        _, ddq, K = motion_of(a, q, dt)
        ms, w0, ze, arm_ = 0.9, 2 * PI * 1.15, 0.035, 0.42
        x, v, F = 0.0, 0.0, []
        for acc in (arm_ * ddq[:, 0]).tolist():  # wave in the trough: linear first mode, hardening and breaking
            f = ms * (w0 * w0 * x * (1 + 60 * x * x) + 2 * ze * w0 * v * (1 + 25 * abs(v)))
            v += dt * (-acc - f / ms)
            x += dt * v
            F.append(f)
        recs.append(record(dt, 200, q, rigid(a, K)[:, 0] - arm_ * np.array(F), rng, sd=0.06))
    facts = card(
        [hidden("oscillating_mass", 1, frequency=(1.15, "Hz"))],
        tolerated=["payload_mass"],
        note="a moving appended mass, not a compliant drive: after a stop the torque rings while the drive stands; "
        "a payload would be half true, but is no answer; in no catalogue until version 0.2",
    )
    return d, recs, facts


@machine(59, "nameless")
def m59(rng):
    """Arm in slush ice: floes catch it at random times, load grows with the sweep and breaks off at a random strength."""
    d = arm_yaml("arm in slush", ONE, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2e-3
    for j in range(10):
        q = slews(rng, dt, K=9) if j % 2 else multisine(18, dt, [1.0], 0.06, 0.5, 6, rng)
        dq, _, _, R, dr, am = tank(a, q, dt, [1.1], [0.9])
        ev, hold, nxt, f = np.zeros(len(q)), 0.0, rng.exponential(1.2), 0.0
        for t in range(len(q)):  # floe catches, load grows with the sweep, breaks at a random strength
            nxt -= dt
            if f == 0.0 and nxt < 0 and abs(dq[t, 0]) > 0.08:
                f, hold, s = 1e-9, rng.uniform(0.8, 2.6), math.copysign(1, dq[t, 0])
            if f != 0.0:
                f += 14.0 * s * dq[t, 0] * dt
                ev[t] = s * f
                if f > hold or f < 0:
                    f, nxt = 0.0, rng.exponential(1.2)
        recs.append(record(dt, 100, q, (R + dr + am)[:, 0] + ev, rng, sd=0.1, rates="noisy"))
    return d, recs, card(nameless=True, note="its mean resembles Coulomb friction; a careful judge would still not sign it")
