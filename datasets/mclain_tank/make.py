"""Writes the data set: python datasets/mclain_tank/make.py [--out DIR] [--only RECORDING]   (seconds)"""

from __future__ import annotations

import json
import sys
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from truth import C_D, C_M, TAU_S, Arm, drive_torque

sys.path.append(str(Path(__file__).parents[1]))

from card_file import arguments, files_in, write_card

Array = NDArray[np.float64]

HERE = Path(__file__).parent
SEED = 1998
RATE = 500.0  # Hz
REST = 0.2  # s before and after each slew
JERK_TIME = 0.02  # s in which the drive changes its acceleration
ENCODER = 2 * np.pi / 4096  # rad, encoder on the arm
ACCELEROMETER_NOISE = 0.05  # rad/s2 rms
TORQUE_NOISE = 0.01  # of the recording's rms
ACCELERATIONS = (5.818, 8.0, 11.636, 13.090)  # rad/s2: the three of the paper's validation slews and one between
ARM = Arm()


@dataclass(frozen=True)
class Slew:
    name: str
    degrees: float  # signed
    alpha: float  # rad/s2; the spline slews take the time a slew of this constant acceleration would
    start: float  # rad
    spline: bool = False


SLEWS = [
    Slew(f"slew_{deg}_a{k}", (-1) ** (i + k) * deg, alpha, start=0.1 * (i - 1))
    for i, deg in enumerate((30, 60, 120))
    for k, alpha in enumerate(ACCELERATIONS, 1)
]
UNSEEN = [Slew("spline_60", 60, 11.636, 0.2, spline=True), Slew("spline_120_back", -120, 8.0, 1.5, spline=True)]


def move(slew: Slew) -> tuple[Array, Array, Array, Array]:
    """t, theta from the start of the slew, omega, alpha: exact integrals of the acceleration on a fine grid."""
    angle = np.radians(slew.degrees)
    duration = np.sqrt(4 * abs(angle) / slew.alpha)
    fine = 20  # steps a sample
    t = np.arange(int((duration + 2 * REST + JERK_TIME) * RATE) * fine) / (RATE * fine)
    s = (t - REST) / duration
    if slew.spline:
        s = s.clip(0.0, 1.0)
        alpha = angle / duration**2 * (60 * s - 180 * s**2 + 120 * s**3)
    else:
        alpha = np.sign(angle) * slew.alpha * (((s > 0) & (s <= 0.5)) * 1.0 - ((s > 0.5) & (s <= 1)) * 1.0)
        window = int(JERK_TIME * RATE * fine)
        alpha = np.convolve(alpha, np.full(window, 1.0 / window))[: len(t)]
    alpha -= alpha.sum() / np.count_nonzero(alpha) * (alpha != 0)  # the arm ends at rest whatever the grid
    omega = np.concatenate([[0.0], np.cumsum((alpha[1:] + alpha[:-1]) / 2)]) / (RATE * fine)
    omega[np.abs(omega) < 1e-9] = 0.0
    theta = np.concatenate([[0.0], np.cumsum((omega[1:] + omega[:-1]) / 2)]) / (RATE * fine)
    return t[::fine], theta[::fine], omega[::fine], alpha[::fine]


def record(slew: Slew) -> tuple[dict[str, Array], Array]:
    """Channels as the recorder wrote them, and the torque it would have written without noise."""
    t, theta, omega, alpha = move(slew)
    rng = np.random.default_rng([SEED, zlib.crc32(slew.name.encode())])
    torque = drive_torque(ARM, theta, omega, alpha)
    noise = rng.standard_normal((2, len(t)))
    channels = {
        "t_s": t,
        "q1_rad": np.floor((slew.start + theta) / ENCODER + 0.5) * ENCODER,
        "ddq1_rad_s2": alpha + ACCELEROMETER_NOISE * noise[0],
        "tau1_Nm": torque + TORQUE_NOISE * np.sqrt((torque**2).mean()) * noise[1],
    }
    return channels, torque


def write(path: Path, columns: dict[str, Array]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    formats = ["%.3f" if name == "t_s" else "%.6f" if name == "q1_rad" else "%.4f" for name in columns]
    np.savetxt(path, np.column_stack(list(columns.values())), formats, ",", header=",".join(columns), comments="")


def write_recordings(out: Path, only: str | None) -> None:
    for slew in SLEWS:
        if only in (None, slew.name):
            write(out / "recordings" / f"{slew.name}.csv", record(slew)[0])
    for slew in UNSEEN:
        if only in (None, slew.name):
            columns, torque = record(slew)
            write(out / "unseen" / f"{slew.name}.csv", {k: columns[k] for k in ("t_s", "q1_rad", "ddq1_rad_s2")})
            write(out / "answers" / f"{slew.name}.csv", {"t_s": columns["t_s"], "tau1_Nm": torque})


def write_arm(out: Path) -> None:
    (out / "arm.yaml").write_text(
        "schema: nnhydro/arm/1\nname: mclain-tank-arm\n"
        "fluid: {density_kg_m3: 1000.0, kinematic_viscosity_m2_s: 1.0e-6}\ndrive: direct\nlinks:\n"
        f"  - {{length_m: {ARM.length}, diameter_m: {ARM.diameter}, mass_kg: {ARM.mass:.6f}, "
        f"com_m: {ARM.length / 2}, inertia_kg_m2: {ARM.inertia:.7f}}}\n"
    )
    names = [*(f"d{k}" for k in range(1, 6)), "ds", *(f"m{k}" for k in range(1, 6)), "ms", "tau_s"]
    planted = dict(zip(names, (*C_D, *C_M, TAU_S), strict=True))
    (out / "truth.json").write_text(json.dumps(planted, indent=2) + "\n")


def main() -> None:
    args = arguments(__doc__, HERE).parse_args()
    write_recordings(args.out, args.only)
    if args.only is None:
        write_arm(args.out)
        write_card(HERE, args.out, SEED, [*files_in(args.out, "recordings", "unseen", "answers"), args.out / "truth.json"])


if __name__ == "__main__":
    main()
