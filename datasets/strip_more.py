"""A larger campaign of a tank: python datasets/strip_more.py SET COUNT OUT   (minutes; seconds where SET/strips has the flows)

OUT gets the recordings that SET (ns_tank or vortex_tank) lists, and COUNT more of the same kinds: 6 slews, 5 reversals, 3 tows, 3 random
and 3 regular oscillations of each 20. Extents and starts are drawn uniformly, all else log-uniformly, within what the listed motions do. A
motion whose strips would move faster than in any listed one is drawn again. No nnhydro is imported.
"""

from __future__ import annotations

import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from strip_arm import strip_motions
from strip_tank import Run, Tank, move, record, write, write_arm

HERE = Path(__file__).parent
KINDS = ("slew", "reverse", "fourier", "oscillate", "slew", "tow", "reverse", "slew", "fourier", "oscillate",
         "reverse", "slew", "tow", "slew", "reverse", "oscillate", "fourier", "slew", "tow", "reverse")
SMALLEST = 0.4  # of the largest extent
OFF = 15.0  # degrees: largest distance of a slew's middle from 0
ATTEMPTS = 100


def drawn_runs(tank: Tank, count: int) -> list[Run]:
    """`count` motions, each from a stream of its own name."""
    fastest = max(speed(tank, run) for run in tank.runs)
    return [drawn(tank, f"{KINDS[number % len(KINDS)]}_drawn_{number + 1:02d}", fastest) for number in range(count)]


def speed(tank: Tank, run: Run) -> float:
    """Largest speed of a strip, diameters a second."""
    return float(np.abs(strip_motions(move(tank, run), tank.links())[0]).max())


def drawn(tank: Tank, name: str, fastest: float) -> Run:
    """A motion of the kind that its name begins with, no strip faster than `fastest`."""
    kind, rng = name.split("_")[0], tank.draw(name)
    listed = [run for run in tank.runs if run.name.split("_")[0] == kind]
    make = {"fourier": random_sines, "oscillate": sines}.get(kind, stops)
    for _ in range(ATTEMPTS):
        run = replace(make(listed, rng), name=name)
        if speed(tank, run) <= fastest:
            return run
    raise SystemExit(f"{name}: {ATTEMPTS} motions were faster than {fastest:.1f} diameters a second")


def between(values: list[float], rng: np.random.Generator) -> float:
    """A number between the least and the largest, log-uniform."""
    return float(np.exp(rng.uniform(np.log(min(values)), np.log(max(values)))))


def anywhere(listed: list[Run], rng: np.random.Generator) -> list[float]:
    """Angles at the start, degrees."""
    widest = [max(abs(run.start[joint]) for run in listed) for joint in range(2)]
    return [float(rng.uniform(-w, w)) for w in widest]


def random_sines(listed: list[Run], rng: np.random.Generator) -> Run:
    """Random sines of both joints, of the listed length."""
    start = anywhere(listed, rng)
    return Run("", (start[0], start[1]), multi=between([run.multi for run in listed], rng), seconds=listed[0].seconds)


def sines(listed: list[Run], rng: np.random.Generator) -> Run:
    """An oscillation of joint 1; half of them with one of joint 2, 0.6 times as large."""
    start, known = anywhere(listed, rng), [sine for run in listed for sine in run.sines if sine[0] == 1]
    amplitude = between([degrees for _, degrees, _ in known], rng)
    hz = between([degrees * f for _, degrees, f in known], rng) / amplitude
    second = ((2, amplitude * float(rng.choice([-0.6, 0.6])), hz),) if rng.random() < 0.5 else ()
    return Run("", (start[0], start[1]), sines=((1, amplitude, hz), *second), seconds=between([run.seconds for run in listed], rng))


def stops(listed: list[Run], rng: np.random.Generator) -> Run:
    """Slews of the joints that move in one of the listed motions, with its pause and its ratios of steps."""
    start, like = anywhere(listed, rng), listed[rng.integers(len(listed))]
    widest = [max(abs(step[joint]) for run in listed for step in run.steps) for joint in range(2)]
    sizes = [float(rng.uniform(SMALLEST, 1.0) * w * rng.choice([-1.0, 1.0])) for w in widest]
    first = like.steps[0]
    steps = tuple((_of(step[0], first[0], sizes[0]), _of(step[1], first[1], sizes[1])) for step in like.steps)
    for joint in range(2):
        if first[joint]:
            start[joint] = -steps[0][joint] / 2 + float(rng.uniform(-OFF, OFF))
    acceleration = between([run.acceleration for run in listed], rng)
    tow = between([run.tow for run in listed], rng) * float(rng.choice([-1.0, 1.0])) if like.tow else 0.0
    return replace(like, start=(start[0], start[1]), steps=steps, acceleration=acceleration, tow=tow)


def _of(step: float, first: float, size: float) -> float:
    """A step of a joint whose first one is `size`; 0 where it rests."""
    return step / first * size if first else 0.0


def main(name: str, count: int, out: Path) -> None:
    """Write the campaign; flows that SET/strips lacks are computed and kept there."""
    sys.path.insert(0, str(HERE / name))
    import make

    shutil.copytree(HERE / name / "recordings", out / "recordings")
    write_arm(make.TANK, out)
    for run in drawn_runs(make.TANK, count):
        write(out / "recordings" / f"{run.name}.csv", record(make.TANK, run, False)[0])


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))
