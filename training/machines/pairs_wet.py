"""Two effects of comparable size at once in a tank: machines 48, 49, 50, 52 and 54."""

import numpy as np
from arms import ONE, PI, TWO, Arm, arm_yaml
from cards import card, hidden, machine
from drives import lag1, lugre
from logger import record
from motions import multisine, slews, zigzag
from water import developing, regular_wave, tank


@machine(48, "pair")
def m48(rng):
    """One-link arm with a hose in a tank that circulates at 0.12 m/s."""
    d = arm_yaml("arm with hose in a circulating tank", ONE, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(12):
        q = slews(rng, dt, lo=-1.7, hi=1.7) if k % 2 else multisine(20, dt, [1.5], 0.05, 0.45, 6, rng)
        *_, R, dr, am = tank(a, q, dt, [1.1], [0.9], V=(-0.08, 0.09))
        recs.append(record(dt, 100, q, (R + dr + am)[:, 0] + 0.8 * (q[:, 0] + 0.3), rng, sd=0.1, rates="noisy"))
    facts = card(
        [
            hidden("umbilical_stiffness", 1, stiffness=(0.8, "N m/rad"), rest=(-0.3, "rad")),
            hidden("ambient_current", speed=(0.1204, "m/s"), direction=(2.297, "rad")),
        ]
    )
    return d, recs, facts


@machine(49, "pair")
def m49(rng):
    """Boom through a seal (Coulomb) whose drag lags by 0.25 s."""
    d = arm_yaml("sealed boom with a slow wake", [(0.7, 0.09, 3.2, 0.34, 0.14, 0.02)], rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 1e-3
    for k in range(10):
        q = multisine(18, dt, [rng.uniform(0.5, 1.0)], 0.08, 0.7, 7, rng) if k % 2 else slews(rng, dt, K=8)
        dq, _, _, R, dr, am = tank(a, q, dt, [1.2], [0.8], S=12)
        tau = (R + am)[:, 0] + lag1(dr[:, 0], 0.25, dt) + lugre(dq[:, 0], dt, 0.8, z0=2e-3)
        recs.append(record(dt, 100, q, tau, rng, sd=0.15, rates="noisy"))
    facts = card(
        [
            hidden("coulomb_friction", 1, coulomb=(0.8, "N m")),
            hidden("flow_memory", partial=["wake_development"], time=(0.25, "s")),
        ]
    )
    return d, recs, facts


@machine(50, "pair")
def m50(rng):
    """Two-link arm on a tilted frame, elbow drive viscous."""
    d = arm_yaml("tilted two-link arm, oil-filled elbow", TWO, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(10):
        q = slews(rng, dt, 2, (-2.0, -1.5), (2.0, 1.5), moves=(1.0, 3.0)) if k % 2 else multisine(18, dt, [1.6, 1.2], 0.05, 0.45, 6, rng)
        dq, _, _, R, dr, am = tank(a, q, dt, [1.1, 1.05], [0.9, 0.9])
        p1, p2 = q[:, 0] + 0.5, q[:, 0] + q[:, 1] + 0.5
        tau = R + dr + am
        tau[:, 1] += 0.45 * np.cos(p2) + 0.5 * dq[:, 1]
        tau[:, 0] += 0.45 * np.cos(p2) + 1.1 * np.cos(p1)
        recs.append(record(dt, 100, q, tau, rng, sd=(0.2, 0.06), ar=0.3))
    facts = card(
        [
            hidden("buoyancy_tilt", link1=(1.1, "N m"), link2=(0.45, "N m")),
            hidden("viscous_friction", 2, viscous=(0.5, "N m s/rad")),
        ]
    )
    return d, recs, facts


@machine(52, "pair")
def m52(rng):
    """One-link arm slewing from rest; wake builds up over s/D, and the strain bridge reads 0.55 N m too little."""
    d = arm_yaml("cylinder slewing from rest, bridge not zeroed", ONE, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    for k in range(12):
        q = zigzag(rng, dt, 0.4, 2.0, (0.6, 1.8)) if k < 8 else multisine(15, dt, [rng.uniform(0.5, 1.2)], 0.1, 0.6, 5, rng)
        *_, R, dr, am = tank(a, q, dt, [1.1], [1.0], mult=developing(a, dt), S=14)
        recs.append(record(dt, 100, q, (R + dr + am)[:, 0] - 0.55, rng, sd=0.12, rates="noisy"))
    facts = card([hidden("torque_bias", 1, offset=(-0.55, "N m")), hidden("wake_development", partial=["flow_memory", "wake_reentry"])])
    return d, recs, facts


@machine(54, "pair")
def m54(rng):
    """One-link arm with a hose under a regular wave (0.7 Hz, 0.08 m/s), clock_s given."""
    d = arm_yaml("arm with hose in a wave basin", ONE, rho=998.0)
    a = Arm(d, rng)
    recs, dt = [], 2.5e-3
    om, amp, be = 2 * PI * 0.7, 0.08, -0.4
    for k in range(10):
        q = slews(rng, dt, K=11) if k % 2 else multisine(24, dt, [1.0], 0.05, 0.35, 5, rng)
        clock = 120.0 * k
        wave = regular_wave(np.arange(len(q)) * dt + clock, amp, om, be)
        *_, R, dr, am = tank(a, q, dt, [1.1], [0.85], wave=wave)
        recs.append(record(dt, 80, q, (R + dr + am)[:, 0] + 1.2 * (q[:, 0] - 0.15), rng, sd=0.12, clock=clock))
    facts = card(
        [
            hidden("wave_orbital", amplitude=(0.08, "m/s"), frequency=(0.7, "Hz")),
            hidden("umbilical_stiffness", 1, stiffness=(1.2, "N m/rad"), rest=(0.15, "rad")),
        ]
    )
    return d, recs, facts
