"""Motions, sensors and files of a tank whose strips have flows of their own: shared by ns_tank/make.py and vortex_tank/make.py.

Imports nothing of nnhydro. What differs between the tanks stands in their make.py: seed, water, motions, and the forces of the strips.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from card_file import arguments, files_in, write_card
from numpy.typing import NDArray
from scipy import signal
from strip_arm import GAUSS, Link, Motion, rigid_torque, water_torque

Array = NDArray[np.float64]

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


@dataclass(frozen=True)
class Tank:
    """What a tank has of its own: its folder, seed, water as arm.yaml says it, motions, and the forces (n, strips) N/m of its strips."""

    folder: Path
    seed: int
    fluid: str
    runs: Sequence[Run]
    unseen: Sequence[Run]
    strip_forces: Callable[[Motion, list[Link]], Array]

    def draw(self, name: str) -> np.random.Generator:
        """A stream of its own for each name, so that any one file can be remade alone."""
        return np.random.default_rng([self.seed, zlib.crc32(name.encode())])

    def links(self) -> list[Link]:
        """Masses, mass centres and inertias as they are: each drawn with 2 % around what arm.yaml says."""
        off = 1.0 + KNOWN_TO * self.draw("arm").standard_normal((2, 3))
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


def waves(tank: Tank, run: Run) -> Array:
    """(n, 2) rad: sines that fade in within a quarter of a second, or random ones of 0.15 to 0.9 Hz that fade in and out."""
    t = np.arange(int(run.seconds * RATE)) / RATE
    found = np.zeros((len(t), 2))
    for joint, amplitude, hz in run.sines:
        found[:, joint - 1] = np.radians(amplitude) * np.sin(2 * np.pi * hz * t) * smooth(t / 0.25)
    if run.multi:
        rng = tank.draw(run.name)
        for joint in range(2):
            f = rng.uniform(0.15, 0.9, 4)
            wave = rng.uniform(0.4, 1.0, 4) / f @ np.sin(2 * np.pi * f[:, None] * t + rng.uniform(0, 2 * np.pi, (4, 1)))
            wave = (wave - wave[0]) * smooth(t / 0.8) * smooth((run.seconds - t) / 0.8)
            found[:, joint] = np.radians(run.multi) * (1.0 if joint == 0 else 1.3) * wave / np.abs(wave).max()
    return found


def move(tank: Tank, run: Run) -> Motion:
    """What the arm does: each servo is a damped second-order follower; the carriage starts and goes on at its speed."""
    relative = np.radians(run.start) + (waves(tank, run) if run.seconds else slews(run))
    relative = np.concatenate([np.repeat(relative[:1], int((REST + (0.5 if run.tow else 0.0)) * RATE), axis=0), relative])
    t, omega = np.arange(len(relative)) / RATE, 2 * np.pi * SERVO_HZ
    servo = ([[0.0, 1.0], [-(omega**2), -2 * SERVO_DAMPING * omega]], [[0.0], [omega**2]], np.eye(2), np.zeros((2, 1)))
    states = [signal.lsim(servo, relative[:, j], t, X0=[relative[0, j], 0.0])[1] for j in range(2)]
    q, dq = np.stack([s[:, 0] for s in states], 1), np.stack([s[:, 1] for s in states], 1)
    ddq = omega**2 * (relative - q) - 2 * SERVO_DAMPING * omega * dq
    u0 = run.tow * smooth((t - 0.1) / 0.7)
    return Motion(t, *(np.cumsum(x, axis=1) for x in (q, dq, ddq)), u0, np.gradient(u0, t))


def water(tank: Tank, run: Run, m: Motion, again: bool) -> Array:
    """Strip forces (n, strips) N/m, from strips/ or from the flow solver, which then writes them there."""
    path = tank.folder / "strips" / f"{run.name}.npy"
    if again or not path.is_file():
        found = tank.strip_forces(m, tank.links())
        if not np.isfinite(found).all():
            raise SystemExit(f"{run.name}: the flow did not stay finite")
        path.parent.mkdir(exist_ok=True)
        np.save(path, found.astype(np.float32))
    stored: Array = np.load(path).astype(float)
    assert stored.shape == (len(m.t), 2 * GAUSS), f"{path}: of another motion: --flow makes it again"
    return stored


def record(tank: Tank, run: Run, again: bool) -> tuple[dict[str, Array], Array]:
    """Channels as the recorder wrote them, and the torques (n, 2) it would have written without noise."""
    m, rng, links = move(tank, run), tank.draw(run.name + " sensors"), tank.links()
    torque = rigid_torque(m, links) + water_torque(m, links, water(tank, run, m, again))
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


def write_motions(tank: Tank, out: Path, only: str | None, again: bool) -> None:
    for run in [*tank.runs, *tank.unseen]:
        if only not in (None, run.name):
            continue
        columns, clean = record(tank, run, again)
        if run in tank.runs:
            write(out / "recordings" / f"{run.name}.csv", columns)
        else:
            write(out / "unseen" / f"{run.name}.csv", {k: v for k, v in columns.items() if not k.endswith("_Nm")})
            write(out / "answers" / f"{run.name}.csv", {"t_s": columns["t_s"], "tau1_Nm": clean[:, 0], "tau2_Nm": clean[:, 1]})


def write_arm(tank: Tank, out: Path) -> None:
    lines = ["schema: nnhydro/arm/1", f"name: {tank.folder.name.replace('_', '-')}-arm", f"fluid: {tank.fluid}", "drive: direct", "links:"]
    lines += [f"  - {{length_m: {k.length}, diameter_m: {k.diameter}, mass_kg: {k.mass}, com_m: {k.com}, inertia_kg_m2: {k.inertia}, "
              f"known_to: {KNOWN_TO}}}" for k in NOMINAL]
    (out / "arm.yaml").write_text("\n".join(lines) + "\n")
    (out / "answers").mkdir(exist_ok=True)
    (out / "answers" / "truth.json").write_text(json.dumps({"links": [asdict(k) for k in tank.links()]}, indent=2) + "\n")


def main(tank: Tank, description: str | None) -> None:
    """What `make.py` of a tank does with its arguments."""
    parser = arguments(description, tank.folder)
    parser.add_argument("--flow", action="store_true", help="compute the strip forces again")
    args = parser.parse_args()
    write_motions(tank, args.out, args.only, args.flow)
    if args.only is None:
        write_arm(tank, args.out)
        files = [*files_in(args.out, "recordings", "unseen", "answers"), *sorted((tank.folder / "strips").iterdir())]
        write_card(tank.folder, args.out, tank.seed, files)
