"""Writes the data set: python datasets/ns_tank/make.py [--out DIR] [--only NAME] [--flow]

The strip forces of every motion lie in strips/ as the flow solver made them; `--flow` computes them again (about a minute of one core
each), as does a motion whose file is missing, so that a run that was stopped goes on where it was.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import platform
import re
import zlib
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy import signal
from truth import GAUSS, Link, Motion, rigid_torque, strip_forces, water_torque

Array = NDArray[np.float64]

HERE = Path(__file__).parent
SEED = 1966
RATE = 250.0  # Hz of the simulation
RECORDER_HZ = 125.0
ANTI_ALIAS_HZ = 25.0  # fourth-order Butterworth, the same on torques and angles
ENCODER = 2 * np.pi / 65536  # rad
TORQUE_NOISE = 0.01  # of the channel's rms over the recording
KNOWN_TO = 0.02
REST = 0.3  # s at rest before each motion
SERVO_HZ, SERVO_DAMPING = 4.0, 0.8  # closed loop of the position servos
NOMINAL = [Link(0.40, 0.04, 0.55, 0.20, 0.0090), Link(0.40, 0.04, 0.45, 0.19, 0.0072)]


@dataclass(frozen=True)
class Run:
    """One motion: per joint (relative angles) the stops in degrees, the acceleration of slews, what lies between, how the carriage goes."""

    name: str
    start: tuple[float, float] = (0.0, 0.0)  # degrees
    steps: tuple[tuple[float, float], ...] = ()  # degrees, one slew after another
    acceleration: float = 1.0  # rad/s2 of the faster joint
    pause: float = 0.0  # s between slews
    sines: tuple[tuple[int, float, float], ...] = ()  # joint, amplitude in degrees, Hz
    seconds: float = 0.0  # of the sines
    multi: float = 0.0  # degrees: random sines of both joints
    tow: float = 0.0  # m/s
    jerk: bool = False  # minimum jerk instead of constant acceleration


RUNS = [
    Run("slew_slow_both", (-40, -30), ((44, 28),), 0.35),
    Run("slew_mid_both", (35, 20), ((-38, -30),), 0.6),
    Run("slew_fast_both", (-30, 40), ((45, -30),), 1.4),
    Run("slew_mid_link1", (30, -50), ((-48, 0),), 0.7),
    Run("slew_fast_link2", (0, -45), ((0, 90),), 1.6),
    Run("slew_mid_opposed", (20, -30), ((-50, 60),), 1.0),
    Run("reverse_straight_both", (-10, 10), ((22, 12), (-22, -12)), 0.8),
    Run("reverse_straight_link1", (0, -35), ((30, 0), (-30, 0)), 1.2),
    Run("reverse_pause_both", (10, -10), ((-25, 15), (25, -15)), 0.9, 0.5),
    Run("reverse_pause_link2", (-20, 30), ((0, -50), (0, 50)), 1.6, 0.3),
    Run("reverse_thrice", (0, 20), ((14, 8), (-18, -10), (16, 6)), 1.0),
    Run("tow_slew_1", (-30, 10), ((25, -20),), 0.7, tow=0.12),
    Run("tow_slew_2", (-10, -40), ((-35, 70),), 1.1, tow=0.10),
    Run("tow_slew_3", (-20, -30), ((25, 20),), 0.5, tow=0.12),
    Run("fourier_1", (0, 0), multi=13, seconds=5.0),
    Run("fourier_2", (10, -30), multi=14, seconds=5.0),
    Run("fourier_3", (-15, 30), multi=9, seconds=5.0),
    Run("oscillate_kc3", (0, 20), sines=((1, 2.1, 1.6),), seconds=3.4),
    Run("oscillate_kc8", (10, -20), sines=((1, 5.0, 0.55), (2, 3.0, 0.55)), seconds=4.6),
    Run("oscillate_kc20", (-10, 10), sines=((1, 11.0, 0.26),), seconds=5.0),
]
UNSEEN = [
    Run("reach", (-25, 30), ((30, -35), (-18, 30)), 0.9, 0.15, jerk=True),
    Run("fourier_new", (5, 15), multi=16, seconds=5.0),
    Run("tow_reverse", (10, -20), ((-22, 20), (22, -10)), 0.9, tow=0.10),
    Run("oscillate_kc12", (0, 0), sines=((1, 7.0, 0.42), (2, -4.0, 0.42)), seconds=5.0),
]


def draw(name: str) -> np.random.Generator:
    """A stream of its own for each name, so that any one file can be remade alone."""
    return np.random.default_rng([SEED, zlib.crc32(name.encode())])


def true_links() -> list[Link]:
    """Masses, mass centres and inertias as they are: each drawn with 2 % around what arm.yaml says."""
    off = 1.0 + KNOWN_TO * draw("arm").standard_normal((2, 3))
    return [replace(k, mass=k.mass * o[0], com=k.com * o[1], inertia=k.inertia * o[2]) for k, o in zip(NOMINAL, off, strict=True)]


def smooth(share: Array) -> Array:
    """Minimum jerk from 0 to 1."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def slews(run: Run) -> Array:
    """(n, 2) rad: one slew after another at constant acceleration and deceleration."""
    pieces, place = [], np.zeros(2)
    for step in run.steps:
        way = np.radians(step)
        duration = 2 * np.sqrt(np.abs(way).max() / run.acceleration)
        s = np.arange(int((duration + run.pause) * RATE)) / RATE / duration
        half = np.where(s < 0.5, 2 * s**2, 1 - 2 * (1 - np.minimum(s, 1.0)) ** 2)
        pieces.append(place + (smooth(s) if run.jerk else half)[:, None] * way)
        place = place + way
    pieces.append(np.repeat(place[None], int(1.0 * RATE), axis=0))
    return np.concatenate(pieces)


def waves(run: Run) -> Array:
    """(n, 2) rad: sines that fade in within a quarter of a second, or random ones of 0.15 to 0.9 Hz that fade in and out."""
    t = np.arange(int(run.seconds * RATE)) / RATE
    found = np.zeros((len(t), 2))
    for joint, amplitude, hz in run.sines:
        found[:, joint - 1] = np.radians(amplitude) * np.sin(2 * np.pi * hz * t) * smooth(t / 0.25)
    if run.multi:
        rng = draw(run.name)
        for joint in range(2):
            f = rng.uniform(0.15, 0.9, 4)
            wave = rng.uniform(0.4, 1.0, 4) / f @ np.sin(2 * np.pi * f[:, None] * t + rng.uniform(0, 2 * np.pi, (4, 1)))
            wave = (wave - wave[0]) * smooth(t / 0.8) * smooth((run.seconds - t) / 0.8)
            found[:, joint] = np.radians(run.multi) * (1.0 if joint == 0 else 1.3) * wave / np.abs(wave).max()
    return found


def move(run: Run) -> Motion:
    """What the arm does: each servo is a damped second-order follower; the carriage starts and goes on at its speed."""
    relative = np.radians(run.start) + (waves(run) if run.seconds else slews(run))
    relative = np.concatenate([np.repeat(relative[:1], int((REST + (0.5 if run.tow else 0.0)) * RATE), axis=0), relative])
    t, omega = np.arange(len(relative)) / RATE, 2 * np.pi * SERVO_HZ
    servo = ([[0.0, 1.0], [-(omega**2), -2 * SERVO_DAMPING * omega]], [[0.0], [omega**2]], np.eye(2), np.zeros((2, 1)))
    states = [signal.lsim(servo, relative[:, j], t, X0=[relative[0, j], 0.0])[1] for j in range(2)]
    q, dq = np.stack([s[:, 0] for s in states], 1), np.stack([s[:, 1] for s in states], 1)
    ddq = omega**2 * (relative - q) - 2 * SERVO_DAMPING * omega * dq
    u0 = run.tow * smooth((t - 0.1) / 0.7)
    return Motion(t, *(np.cumsum(x, axis=1) for x in (q, dq, ddq)), u0, np.gradient(u0, t))


def water(run: Run, m: Motion, again: bool) -> Array:
    """Strip forces (n, strips) N/m, from strips/ or from the flow solver, which then writes them there."""
    path = HERE / "strips" / f"{run.name}.npy"
    if again or not path.is_file():
        found = strip_forces(m, true_links())
        if not np.isfinite(found).all():
            raise SystemExit(f"{run.name}: the flow did not stay finite")
        path.parent.mkdir(exist_ok=True)
        np.save(path, found.astype(np.float32))
    stored: Array = np.load(path).astype(float)
    assert stored.shape == (len(m.t), 2 * GAUSS), f"{path}: of another motion: --flow makes it again"
    return stored


def record(run: Run, again: bool) -> tuple[dict[str, Array], Array]:
    """Channels as the recorder wrote them, and the torques (n, 2) it would have written without noise."""
    m, rng = move(run), draw(run.name + " sensors")
    torque = rigid_torque(m, true_links()) + water_torque(m, true_links(), water(run, m, again))
    low_pass = signal.butter(4, ANTI_ALIAS_HZ, fs=RATE, output="sos")
    q = np.column_stack([m.phi[:, 0], m.phi[:, 1] - m.phi[:, 0]])
    channels = np.column_stack([q, torque, m.u0])
    settled = signal.sosfilt_zi(low_pass)[:, :, None] * channels[0]
    seen = signal.sosfilt(low_pass, channels, axis=0, zi=settled)[0][::int(RATE / RECORDER_HZ)]
    clean = seen[:, 2:4]
    noisy = clean + TORQUE_NOISE * np.sqrt((clean**2).mean(axis=0)) * rng.standard_normal(clean.shape)
    angles = np.round(seen[:, :2] / ENCODER) * ENCODER
    out = {"t_s": m.t[::int(RATE / RECORDER_HZ)], "q1_rad": angles[:, 0], "q2_rad": angles[:, 1]}
    if run.tow:
        out["u0_m_s"] = seen[:, 4] + 0.0005 * rng.standard_normal(len(seen))
    return out | {"tau1_Nm": noisy[:, 0], "tau2_Nm": noisy[:, 1]}, clean


def write(path: Path, columns: dict[str, Array]) -> None:
    """A CSV file with fixed digits."""
    digits = {"t_s": 4, "u0_m_s": 5}
    formats = [f"%.{digits.get(name, 6)}f" for name in columns]
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, np.column_stack(list(columns.values())), formats, ",", header=",".join(columns), comments="")


def write_motions(out: Path, only: str | None, again: bool) -> None:
    for run in [*RUNS, *UNSEEN]:
        if only not in (None, run.name):
            continue
        columns, clean = record(run, again)
        if run in RUNS:
            write(out / "recordings" / f"{run.name}.csv", columns)
        else:
            write(out / "unseen" / f"{run.name}.csv", {k: v for k, v in columns.items() if not k.endswith("_Nm")})
            write(out / "answers" / f"{run.name}.csv", {"t_s": columns["t_s"], "tau1_Nm": clean[:, 0], "tau2_Nm": clean[:, 1]})


ARM = """\
schema: nnhydro/arm/1
name: ns-tank-arm
fluid: {density_kg_m3: 1190.0, kinematic_viscosity_m2_s: 2.4e-5}   # water with 73 % glycerine
drive: direct
links:
"""


def write_arm(out: Path) -> None:
    lines = [f"  - {{length_m: {k.length}, diameter_m: {k.diameter}, mass_kg: {k.mass}, com_m: {k.com}, inertia_kg_m2: {k.inertia}, "
             f"known_to: {KNOWN_TO}}}\n" for k in NOMINAL]
    (out / "arm.yaml").write_text(ARM + "".join(lines))
    (out / "answers").mkdir(exist_ok=True)
    (out / "answers" / "truth.json").write_text(json.dumps({"links": [asdict(k) for k in true_links()]}, indent=2) + "\n")


def write_card(out: Path) -> None:
    """Keeps the hand-written head of card.toml and renews what follows: how the files were made and their sums."""
    head = re.split(r"^\[made\]", (HERE / "card.toml").read_text(), flags=re.M)[0]
    files = [out / "arm.yaml", *(p for d in ("recordings", "unseen", "answers") for p in sorted((out / d).iterdir()))]
    files += sorted((HERE / "strips").iterdir())
    sums = [f'"{p.relative_to(HERE if p.parent.name == "strips" else out).as_posix()}" = "{hashlib.sha256(p.read_bytes()).hexdigest()}"'
            for p in files]
    made = [f'seed = {SEED}\npython = "{platform.python_version()}"\nnumpy = "{np.__version__}"', f'scipy = "{scipy.__version__}"']
    (out / "card.toml").write_text(head + "\n".join(["[made]", *made, "", "[sha256]", *sums]) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--only", help="remake this recording or unseen motion alone")
    parser.add_argument("--flow", action="store_true", help="compute the strip forces again")
    args = parser.parse_args()
    write_motions(args.out, args.only, args.flow)
    if args.only is None:
        write_arm(args.out)
        write_card(args.out)


if __name__ == "__main__":
    main()
