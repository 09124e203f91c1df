"""Ten campaigns with nothing hidden, among them a table of steady tows and a linear axis."""

from pathlib import Path

import numpy as np
import pandas as pd
from drives import free_swing
from machines import GRAVITY, arm, tank_arm, yaml_of
from mechanics import bare_torques
from motions import Motion, move, tank_set
from record import GEARED, Case, Sensors, noise_like


def healthy_cases(rng: np.random.Generator) -> list[Case]:
    """Ten campaigns (eight here; the tables and the linear axis are written apart) with nothing left out."""
    three = arm([0.42, 0.36, 0.3], [0.065, 0.06, 0.05], [1.6, 1.2, 0.8], [0.95, 1.0, 1.05], [0.85, 0.9, 0.8])
    robot = arm([0.5, 0.45], [0.1, 0.09], [9.0, 6.0], density=0.0, gravity=GRAVITY, known_to=0.03,
                coulomb=np.array([3.0, 1.5]), viscous=np.array([2.0, 1.0]), rotor=np.array([0.3, 0.2]))
    rod = arm([0.8], [0.05], [0.35], [1.1], [1.0], density=1.2, viscosity=1.5e-5, gravity=9.81, known_to=0.02)
    long = [move(rng, k, 2, 138, 25, 200, rate=0.9, tow=u, base_hz=0.04, smooth=0.15, centre=(0.4, 0.0), amp=(1.2, 1.4))
            for k, u in (("slew", 0.0), ("fourier", 0.5), ("reverse", 0.0), ("locked", 0.7))]
    short = [move(rng, k, 2, 2.8, 1000, 1000, rate=2.0, smooth=0.09, base_hz=0.4, rest=0.3)
             for k in ("slew", "fourier", "reverse", "slew", "fourier")]
    swings = [free_swing(rod, a, 24, 100) for a in (1.2, 0.8, 1.7, 0.5, -1.4)]
    dry = tank_set(rng, 250, 9, "rfrffr", 500, rate=1.8, base_hz=0.2, centre=(0.8, 0.6), amp=(1.0, 1.1))
    return [
        Case("tow tank, two links, angles and carriage only, noise of unlike size by 10x in each recording, AR 0.9", tank_arm(rng),
             tank_set(rng, 100, 11, "tttssrffSFhS"), Sensors(0.012, ar=0.9, spread=10)),
        Case("two links, 1 kHz, five recordings of under 3 s, Student t noise, 16384 counts, no rates", tank_arm(rng),
             short, Sensors(0.015, tails=3.0, quantum=2 * np.pi / 16384, angle_noise=0.0)),
        Case("two links, 25 Hz, four recordings of over two minutes, AR 0.98 noise", tank_arm(rng), long,
             Sensors(0.01, ar=0.98, angle_noise=1e-4)),
        Case("two links in a tank, three recordings, masses to 5 %, noisy rates and accelerations", tank_arm(rng, known_to=0.05),
             tank_set(rng, 200, 22, "ssf", rate=1.8, smooth=0.08), Sensors(0.008, rates=0.01, accelerations=0.1, angle_noise=1e-4)),
        Case("industrial robot joints upright, dry, friction and rotors stated to 10 %", robot, dry, GEARED),
        Case("free rod swinging in air, torque columns 0, angle from video", rod, swings, Sensors(angle_noise=4e-4), free=True),
        Case("three links in a tank, noisy rates, 50 Hz", three,
             tank_set(rng, 50, 28, "ffsrfsfr", 400, n=3, base_hz=0.08, amp=(1.0, 1.2, 1.2)), Sensors(0.01, rates=0.02, ar=0.5)),
        Case("belt-driven two links, 20 recordings, uneven sampling, masses to 5 %", tank_arm(rng, remote=True, known_to=0.05),
             tank_set(rng, 80, 8, "ttttttssssrrrffffSSF", 800), Sensors(0.01, spread=5, jitter=True, quantum=2 * np.pi / 4096 / 25)),
    ]


def write_tables(folder: Path, rng: np.random.Generator) -> dict[str, object]:
    """A healthy campaign that is a table of locked tows and steady turns alone."""
    machine = tank_arm(rng)
    (folder / "steady").mkdir(parents=True)
    (folder / "arm.yaml").write_text(yaml_of(machine, folder.name, rng))
    rows = 96
    tow, turn = rng.choice([0.3, 0.55, 0.8, 1.0, 1.25], rows), np.where(np.arange(rows) < 64, 0.0, rng.uniform(-1.0, 1.0, rows))
    q = np.stack([rng.choice(np.radians(np.arange(-75, 76, 15)), rows), rng.choice(np.radians(np.arange(-120, 121, 15)), rows)])
    flat = np.zeros((2, rows))
    mo = Motion(np.arange(rows) * 1.0, q, np.stack([turn, 0 * turn]), flat, np.where(turn == 0, tow, 0.0), 0 * tow, 1, "steady")
    tau = bare_torques(machine, mo)
    rms = np.sqrt((tau**2).mean(axis=1, keepdims=True))
    std = 0.01 * rms * 4 ** rng.uniform(-0.5, 0.5, tau.shape)
    tau = tau + std * rng.normal(size=tau.shape)
    pd.DataFrame({"run": [f"r{k:03d}" for k in range(rows)], "q1_rad": q[0], "q2_rad": q[1], "dq1_rad_s": mo.dq[0], "dq2_rad_s": mo.dq[1],
                  "u0_m_s": mo.u0, "tau1_Nm": tau[0], "tau2_Nm": tau[1], "tau1_std_Nm": std[0], "tau2_std_Nm": std[1]}).to_csv(
        folder / "steady" / "runs.csv", index=False, float_format="%.8g")
    return {"style": "steady table alone: locked tows and steady turns", "links": 2, "hidden": [], "noise_share": 0.01, "rows": rows}


def write_axis(folder: Path, rng: np.random.Generator) -> dict[str, object]:
    """A healthy dry linear axis on air bearings: force is mass times acceleration."""
    (folder / "recordings").mkdir(parents=True)
    mass = 23.4
    (folder / "arm.yaml").write_text(
        "schema: nnhydro/arm/1\nname: linear axis on air bearings\n"
        "fluid: {density_kg_m3: 0.0, kinematic_viscosity_m2_s: 1.0e-6}\njoints: [{type: prismatic}]\nlinks:\n"
        "  - {length_m: 0.4, diameter_m: 0.1, mass_kg: 23.1, com_m: 0.2, inertia_kg_m2: 0.3, known_to: 0.02}\n")
    rows = 0
    for k, kind in enumerate(["slew", "fourier", "reverse", "fourier", "slew", "slew"]):
        mo = move(rng, kind, 1, 7, 200, 400, (0.4,), (0.35,), rate=0.8, base_hz=0.3, smooth=0.04)
        pick = slice(None, None, mo.step)
        force = mass * mo.ddq[0, pick]
        size = 0.015 * force.std() * 5 ** rng.uniform(-0.5, 0.5)
        pd.DataFrame({"t_s": mo.t[pick], "q1_m": np.round(mo.q[0, pick] / 1e-6) * 1e-6,
                      "dq1_m_s": mo.dq[0, pick] + 1e-4 * rng.normal(size=force.size),
                      "tau1_N": force + size * noise_like(rng, Sensors(ar=0.8, tails=4.0), force.size)}).to_csv(
            folder / "recordings" / f"{k + 1:02d}_{kind}.csv", index=False, float_format="%.9g")
        rows += force.size
    return {"style": "dry linear axis on air bearings, scale of 1 micrometre", "links": 1, "hidden": [], "noise_share": 0.015, "rows": rows}
