"""Writes the data set: python datasets/rivera_tank/make.py [--out DIR] [--only RECORDING]   (under a minute)"""

from __future__ import annotations

import json
import sys
import zlib
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from motions import RATE, Motion, follow, fourier, random_tour
from numpy.typing import NDArray
from scipy import signal
from truth import Effects, Link, Seal, motor_torque

sys.path.append(str(Path(__file__).parents[1]))

from card_file import arguments, files_in, write_card

Array = NDArray[np.float64]

HERE = Path(__file__).parent
SEED = 1995
RHO = 1000.0
RECORDER_HZ = 100.0
ANTI_ALIAS_HZ = 25.0  # fourth-order Butterworth, the same on torques and angles
ENCODER = 2 * np.pi / 65536  # rad, potentiometer behind the gear train read with 16 bits
TORQUE_NOISE = 0.01  # of the channel's rms over the recording
SPEEDS = (0.3, 0.55, 0.8, 1.0, 1.25)  # m/s
KNOWN_TO = 0.02
NOMINAL = [
    Link(0.40, 0.06, 1.90, 0.210, 0.0260, C_D=1.15, C_M=1.0, C_M_wake=0.38, C_D_axial=0.012),
    Link(0.35, 0.05, 1.40, 0.165, 0.0145, C_D=1.10, C_M=1.0, C_M_wake=0.38, C_D_axial=0.012),
]
SEALS = [Seal(0.045, 0.012, 0.008), Seal(0.030, 0.010, 0.006)]


@dataclass(frozen=True)
class Run:
    """One recording: how the command is drawn, how fast the carriage goes, how the recorder behaved."""

    name: str
    kind: str  # bang, jerk, fourier
    moving: str = "both"  # link1, link2, both, one (the whole arm as one)
    speed: float = 0.0  # m/s
    ramps: bool = False
    moves: int = 5
    fastest: float = 2.5  # rad/s
    command: str = ""  # runs with the same command name repeat one command
    folded: bool = False  # link 2 in the wake of link 1
    jitter: float = 0.0  # s rms
    seconds: float = 8.0


RUNS = [
    *(Run(f"slew_{kind}_{who}", kind, who) for kind in ("bang", "jerk") for who in ("link1", "link2", "both")),
    Run("slew_bang_one", "bang", "one", jitter=2e-4),
    Run("slew_jerk_one", "jerk", "one"),
    Run("slew_jerk_slow", "jerk", "both", moves=4, fastest=0.7),
    *(Run(f"tow_{k}_bang", "bang", "both", u, moves=6) for k, u in enumerate((0.3, 0.45, 0.55, 0.8, 1.25), 1)),
    *(Run(f"tow_{k}_jerk", "jerk", "both", u, moves=5) for k, u in enumerate((0.3, 0.65), 1)),
    *(Run(f"tow_fold_{k}", "jerk", "both", u, moves=6, folded=True) for k, u in enumerate((0.4, 0.7, 1.0), 1)),
    Run("tow_start_stop_1", "jerk", "both", 0.5, ramps=True, moves=5, fastest=1.5),
    Run("tow_start_stop_2", "bang", "both", 0.9, ramps=True, moves=5, fastest=1.5, jitter=2e-4),
    *(Run(f"fourier1_repeat{k}", "fourier", command="fourier1") for k in (1, 2, 3)),
    Run("fourier2", "fourier", seconds=10.0, fastest=2.0),
    Run("fourier3", "fourier", seconds=10.0, fastest=1.2, jitter=2e-4),
    *(Run(f"fourier_tow1_repeat{k}", "fourier", speed=0.4, command="fourier_tow1") for k in (1, 2, 3)),
    Run("fourier_tow2", "fourier", speed=0.5, seconds=10.0, folded=True),
    Run("fourier_tow3", "fourier", speed=0.7, seconds=8.0, fastest=1.8),
]
UNSEEN = [
    Run("reach", "jerk", moves=5, fastest=2.2),
    Run("fourier_swim", "fourier", seconds=9.0, fastest=2.3),
    Run("tow_work", "bang", speed=0.65, moves=4, fastest=2.0),
    Run("tow_fold", "jerk", speed=0.5, moves=5, folded=True),
]


def draw(name: str) -> np.random.Generator:
    """A stream of its own for each name, so that any one file can be remade alone."""
    return np.random.default_rng([SEED, zlib.crc32(name.encode())])


def true_links() -> list[Link]:
    """Masses, mass centres and inertias as they are: each drawn with 2 % around what arm.yaml says."""
    rng = draw("arm")
    off = 1.0 + KNOWN_TO * rng.standard_normal((2, 3))
    return [
        replace(link, mass=link.mass * o[0], com=link.com * o[1], inertia=link.inertia * o[2])
        for link, o in zip(NOMINAL, off, strict=True)
    ]


def move(run: Run) -> Motion:
    rng = draw(run.command or run.name)
    if run.kind == "fourier":
        command = fourier(rng, run.seconds, run.fastest, run.folded)
    else:
        command = random_tour(rng, run.kind, run.moving, run.moves, run.fastest, run.folded)
    return follow(draw(run.name + " servo"), command, run.speed, run.ramps)


def record(run: Run) -> tuple[dict[str, Array], Array]:
    """Channels as the recorder wrote them, and the torques (n, 2) it would have written without noise."""
    m, rng = move(run), draw(run.name + " sensors")
    torque = motor_torque(m, true_links(), SEALS, RHO)
    t = np.arange(0.0, m.t[-1], 1.0 / RECORDER_HZ)
    t[1:-1] += run.jitter * rng.standard_normal(len(t) - 2).clip(-3.0, 3.0)
    low_pass = signal.butter(4, ANTI_ALIAS_HZ, fs=RATE, output="sos")
    channels = np.column_stack([m.phi, torque, m.u0])
    settled = signal.sosfilt_zi(low_pass)[:, :, None] * channels[0]
    seen = signal.sosfilt(low_pass, channels, axis=0, zi=settled)[0]
    q1, q2, tau1, tau2, u0 = (np.interp(t, m.t, column) for column in seen.T)
    clean = np.column_stack([tau1, tau2])
    noisy = clean + TORQUE_NOISE * np.sqrt((clean**2).mean(axis=0)) * rng.standard_normal(clean.shape)
    out = {"t_s": t, "q1_rad": np.round(q1 / ENCODER) * ENCODER, "q2_rad": np.round(q2 / ENCODER) * ENCODER}
    if run.speed:
        out["u0_m_s"] = u0 + 0.001 * rng.standard_normal(len(t))
    return out | {"tau1_Nm": noisy[:, 0], "tau2_Nm": noisy[:, 1]}, clean


def write(path: Path, columns: dict[str, Array], digits: dict[str, int] | None = None) -> None:
    digits = {"t_s": 5, "clock_s": 2, "u0_m_s": 4, "run": 0} | (digits or {})
    formats = [f"%.{digits.get(name, 5 if name.endswith('_Nm') else 6)}f" for name in columns]
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, np.column_stack(list(columns.values())), formats, ",", header=",".join(columns), comments="")


def write_recordings(out: Path, only: str | None) -> None:
    clock = 9 * 3600.0 + 300.0 * np.arange(len(RUNS))  # s, one run in five minutes: the water calms down in between
    for run, start in zip(RUNS, clock, strict=True):
        if only in (None, run.name):
            columns, _ = record(run)
            write(out / "recordings" / f"{run.name}.csv", columns | {"clock_s": start + columns["t_s"]})
    for run in UNSEEN:
        if only in (None, run.name):
            columns, clean = record(run)
            write(out / "unseen" / f"{run.name}.csv", {k: v for k, v in columns.items() if not k.endswith("_Nm")})
            answer = {"t_s": columns["t_s"], "tau1_Nm": clean[:, 0], "tau2_Nm": clean[:, 1]}
            write(out / "answers" / f"{run.name}.csv", answer)


def steady(phi: Array, dphi: Array, u0: Array) -> Array:
    """(n, 2) N m of each row by itself, with fully developed wakes and without friction."""
    rows = []
    for p, d, u in zip(phi, dphi, u0, strict=True):
        one = Motion(np.zeros(1), p[None], d[None], np.zeros((1, 2)), np.array([u]), np.zeros(1), developed=True)
        rows.append(motor_torque(one, true_links(), SEALS, RHO, Effects(friction=False))[0])
    return np.array(rows)


def table(path: Path, theta: Array, dphi: Array, u0: Array, friction: Array) -> None:
    """One row a run: mean torque and standard deviation over 20 s at the wake's own unsteadiness (6 %)."""
    rng = draw(path.stem)
    phi = np.cumsum(theta, axis=1)
    mean = steady(phi, dphi, u0) + friction
    spread = np.hypot(0.06 * np.abs(mean), 0.008) * rng.uniform(0.8, 1.2, mean.shape)
    mean = mean + spread / np.sqrt(20.0) * rng.standard_normal(mean.shape)  # about one independent value a second
    columns = {"run": np.arange(1.0, len(u0) + 1), "q1_rad": phi[:, 0], "q2_rad": phi[:, 1], "dq1_rad_s": dphi[:, 0]}
    columns |= {"dq2_rad_s": dphi[:, 1], "u0_m_s": u0, "tau1_Nm": mean[:, 0], "tau2_Nm": mean[:, 1]}
    write(path, columns | {"tau1_std_Nm": spread[:, 0], "tau2_std_Nm": spread[:, 1]})


def write_steady(out: Path) -> None:
    """Towing matrix with locked joints, and rotations in still water sampled as the links pass each angle."""
    grid = np.radians(np.arange(-90.0, 91.0, 15.0))
    a, b, u = (g.ravel() for g in np.meshgrid(grid, grid, SPEEDS, indexing="ij"))
    rng = draw("dead band")
    held = rng.uniform(-0.5, 0.5, (len(u), 2)) * [s.coulomb for s in SEALS]  # a locked seal may hold up to its level
    friction = np.column_stack([held[:, 0] - held[:, 1], held[:, 1]])
    table(out / "steady" / "tow_matrix.csv", np.column_stack([a, b]), np.zeros((len(u), 2)), u, friction)
    rates = np.outer([1.0, -1.0], [0.5, 1.0, 1.5, 2.0, 2.5]).ravel()
    turning = {"both motors": (1.0, 1.0), "motor 2": (0.0, 1.0)}
    combos = [(th, r * np.array(who)) for who in turning.values() for r in rates for th in grid[::2]]
    theta = np.array([[0.0, th] for th, _ in combos])
    dphi = np.array([d for _, d in combos])
    elbow = SEALS[1].torque(dphi[:, 1] - dphi[:, 0])
    friction = np.column_stack([SEALS[0].torque(dphi[:, 0]) - elbow, elbow])
    table(out / "steady" / "rotations.csv", theta, dphi, np.zeros(len(theta)), friction)


ARM = """\
schema: nnhydro/arm/1
name: rivera-tank-arm
fluid: {density_kg_m3: 1000.0, kinematic_viscosity_m2_s: 1.0e-6}
drive: {kind: remote, pulley_ratio: 1.0, angle2: absolute}   # q2_rad, dq2_rad_s are absolute; tau are the motors'
links:
"""


def write_arm(out: Path) -> None:
    lines = [
        f"  - {{length_m: {k.length}, diameter_m: {k.diameter}, mass_kg: {k.mass}, com_m: {k.com}, "
        f"inertia_kg_m2: {k.inertia}, known_to: {KNOWN_TO}}}\n"
        for k in NOMINAL
    ]
    (out / "arm.yaml").write_text(ARM + "".join(lines))
    (out / "answers").mkdir(exist_ok=True)
    truth = {"links": [asdict(k) for k in true_links()], "seals": [asdict(s) for s in SEALS]}
    (out / "answers" / "truth.json").write_text(json.dumps(truth, indent=2) + "\n")


def main() -> None:
    args = arguments(__doc__, HERE).parse_args()
    write_recordings(args.out, args.only)
    if args.only is None:
        write_steady(args.out)
        write_arm(args.out)
        write_card(HERE, args.out, SEED, files_in(args.out, "recordings", "steady", "unseen", "answers"))


if __name__ == "__main__":
    main()
