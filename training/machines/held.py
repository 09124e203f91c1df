"""Bodies that are held in waves or in a tow, machines 40 to 45."""

import math

import numpy as np
from arms import PI, Arm, arm_yaml
from cards import card, hidden, machine
from logger import record
from motions import hold, ramp
from water import developing, drag_crisis, regular_wave, shedding, tank

BAR = [(0.8, 0.08, 4.5, 0.4, 0.3, 0.02)]


@machine(40, "held")
def m40(rng):
    """Cylinder held at six angles in a regular wave (0.45 Hz, orbital speed 0.24 m/s); whole torque is the wave's."""
    d = arm_yaml("held cylinder in a wave basin", BAR, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 5e-3
    om, amp, be = 2 * PI * 0.45, 0.24, 0.3
    for k, ang in enumerate((-1.2, -0.6, 0.0, 0.5, 1.0, 1.5)):
        q = hold(ang, 40, dt)
        clock = 300.0 * k + 11.0
        wave = regular_wave(np.arange(len(q)) * dt + clock, amp, om, be)
        *_, R, dr, am = tank(a, q, dt, [1.2], [0.9], wave=wave)
        recs.append(record(dt, 50, q, (R + dr + am)[:, 0], rng, sd=0.12, qsd=2e-4, clock=clock))
    return d, recs, card([hidden("wave_orbital", amplitude=(amp, "m/s"), frequency=(0.45, "Hz"))])


@machine(41, "held")
def m41(rng):
    """Mast held across the tow at ten speeds through the drag crisis."""
    d = arm_yaml("tall mast held across the tow", [(1.1, 0.15, 14.0, 0.5, 1.5, 0.02)], rho=999.0, nu=1.1e-6)
    a = Arm(d, rng)
    recs, dt = [], 5e-3
    for U in (0.3, 0.5, 0.8, 1.1, 1.4, 1.8, 2.2, 2.6, 3.0, 3.3):
        u0 = ramp(18, dt, U, up=2.5, down=2.5)
        q = hold(0.02, 18, dt)
        *_, R, dr, am = tank(a, q, dt, [1.0], [0.9], u0=u0, mult=drag_crisis(a))
        tau = (R + dr + am)[:, 0]
        recs.append(record(dt, 50, q, tau, rng, sd=0.6 + 0.02 * np.abs(tau).max(), qsd=1e-4, u0=u0, ar=0.6))
    facts = card(
        [hidden("reynolds_drag", accept=["drag_form"])],
        note="from one held posture a drag law in speed is the same thing as one in Re",
    )
    return d, recs, facts


@machine(42, "held")
def m42(rng):
    """Strut held across tows in both directions, zero of the balance shifted by 0.7 N m."""
    d = arm_yaml("strut on a balance with a shifted zero", BAR, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 5e-3
    for U in (0.2, 0.35, 0.5, -0.3, 0.65, -0.5, 0.8):
        u0 = ramp(20, dt, U)
        q = hold(0.0, 20, dt)
        *_, R, dr, am = tank(a, q, dt, [1.05], [0.9], u0=u0)
        recs.append(record(dt, 60, q, (R + dr + am)[:, 0] + 0.7, rng, sd=0.1 + 0.1 * abs(U), qsd=1e-4, u0=u0, ar=0.5))
    facts = card(
        [hidden("torque_bias", 1, accept=["buoyancy_tilt", "umbilical_stiffness"], offset=(0.7, "N m"))],
        note="one posture: weight and hose are constants too",
    )
    return d, recs, facts


@machine(43, "held")
def m43(rng):
    """Cylinder held in tows of ten speeds; in-line force at 2 St U/D, amplitude modulated, phase wandering."""
    d = arm_yaml("held cylinder that sheds in a tow", BAR, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(10):
        U = 0.3 + 0.08 * k
        u0 = ramp(22, dt, U)
        q = hold(rng.uniform(-0.3, 0.3), 22, dt)
        jit = np.cumsum(rng.normal(size=len(u0))) * math.sqrt(dt) * 0.4
        p0 = rng.uniform(0, 6.28)
        shed = shedding(a, dt, 0.195, 0.18, jit, p0, swell=0.3)
        *_, R, dr, am = tank(a, q, dt, [1.1], [0.9], u0=u0, shed=shed)
        recs.append(record(dt, 100, q, (R + dr + am)[:, 0], rng, sd=0.15 + 0.15 * U, qsd=1e-4, u0=u0))
    return d, recs, card([hidden("vortex_shedding", strouhal=(0.195, "1"), amplitude=(0.18, "1"))])


@machine(44, "held")
def m44(rng):
    """Held cylinder started quickly from rest at four speeds, both directions; Cd overshoots at 4 diameters."""
    d = arm_yaml("cylinder started impulsively", BAR, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(12):
        U = (0.15, 0.25, 0.35, 0.5)[k % 4] * (1 if k < 8 else -1)
        u0 = ramp(12, dt, U, up=0.25 + 0.5 * (k % 3), down=1.0)
        q = hold(rng.uniform(-0.3, 0.3), 12, dt)
        *_, R, dr, am = tank(a, q, dt, [1.15], [0.8], u0=u0, mult=developing(a, dt, inertia=False))
        recs.append(record(dt, 100, q, (R + dr + am)[:, 0], rng, sd=0.1, qsd=1e-4, u0=u0))
    return d, recs, card([hidden("wake_development", partial=["flow_memory", "wake_reentry"])])


@machine(45, "held")
def m45(rng):
    """Bar held at four angles and towed both ways in a tank that circulates at 0.081 m/s."""
    d = arm_yaml("held bar in a tank that circulates", BAR, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 5e-3
    for k in range(12):
        U = (0.25, 0.4, -0.25, -0.4, 0.6, 0.0)[k % 6]
        u0 = ramp(18, dt, U)
        q = hold((-0.9, -0.3, 0.4, 1.0)[k % 4], 18, dt)
        *_, R, dr, am = tank(a, q, dt, [1.1], [0.9], u0=u0, V=(0.03, 0.075))
        recs.append(record(dt, 50, q, (R + dr + am)[:, 0], rng, sd=0.08, qsd=1e-4, u0=u0))
    return d, recs, card([hidden("ambient_current", speed=(0.0808, "m/s"), direction=(1.19, "rad"))])
