"""Do memory and file handles stay flat? `python training/reliability/soak.py [seconds=7200 count=2000]`: diagnoses in a loop, one process.

Each round reads a small campaign and diagnoses it with another seed. Every tenth campaign has dry friction that the baseline omits (a full
search, held-out errors, findings), and every fifth round writes results, figures and page. After the first tenth, in which libraries fill
their caches, a straight line is fitted to the memory in use as glibc counts it. A leak would show in its slope, in kB per diagnosis. The
resident memory also holds freed memory that was not returned; malloc_trim at the end shows how much. The counts are recorded every 50
diagnoses, and when the run is stopped (Ctrl-C, or kill).
"""

import ctypes
import gc
import os
import signal
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from trials import record, show

from nnhydro.cli.main import run
from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.recordings.campaign import verify_campaign
from nnhydro.report.diagnosis.page import write_diagnosis

PAGE = os.sysconf("SC_PAGE_SIZE")


def resident() -> int:
    """Return the bytes of this process in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


def _trimmed(libc: ctypes.CDLL) -> int:
    libc.malloc_trim(0)
    return resident()


class Heap(ctypes.Structure):
    """What glibc's mallinfo2 tells, in bytes."""

    _fields_ = [(name, ctypes.c_size_t) for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks",
                                                     "fordblks", "keepcost")]


def in_use(libc: ctypes.CDLL) -> int:
    """Return the bytes that are allocated and not freed."""
    gc.collect()
    heap = libc.mallinfo2()
    return int(heap.uordblks + heap.hblkhd)


EFFECT_EVERY, WRITTEN_EVERY, RECORDED_EVERY = 10, 5, 50
RECIPE = """schema: nnhydro/recipe/1
seed: 1
arm: {schema: nnhydro/arm/1, fluid: {density_kg_m3: 1000.0}, links: [
  {length_m: 0.55, diameter_m: 0.07, mass_kg: 1.0, com_m: 0.27, inertia_kg_m2: 0.026}]}
terms: {rigid_body: arm, normal_drag: {C_D: 1.0}, added_mass: {C_M: 0.8}%s}
sensors: {encoder_counts_per_rev: 65536, torque_noise_Nm: 0.02}
motions:
"""
MOTION = "  - {kind: fourier, name: swim%d, q_rad: [%.1f], duration_s: 3.0, reach_rad: [1.0], rate_rad_s: %.1f}\n"
COLUMNS = ("diagnoses", "of these with an effect", "effects named", "seconds", "in use after the first tenth, MB", "in use at the end, MB",
           "slope, kB a diagnosis", "its standard error", "resident after the first tenth, MB", "resident at the end, MB",
           "resident when trimmed, MB", "file handles at first", "file handles at the end")


def campaigns(place: Path) -> tuple[Path, Path]:
    """Write a healthy campaign of five short recordings, and one with dry friction at the joint."""
    made = []
    for name, more in (("healthy", ""), ("rubbing", ", coulomb_friction: {level: 0.5}")):
        (place / f"{name}.yaml").write_text(RECIPE % more + "".join(MOTION % (k, 0.2 * k, 1 + 0.3 * k) for k in range(5)), encoding="utf-8")
        if run(["simulate", str(place / f"{name}.yaml"), "--out", str(place / name), "--quiet"]):
            raise SystemExit("the small campaigns could not be made")
        made.append(place / name)
    return made[0], made[1]


@dataclass
class Counted:
    """What was seen after each diagnosis."""

    memory: list[int] = field(default_factory=list)
    whole: list[int] = field(default_factory=list)
    handles: list[int] = field(default_factory=list)
    named: int = 0

    def row(self, seconds: float, trimmed: int) -> list[object]:
        """Return the line of the table."""
        n = len(self.memory)
        late = np.array(self.memory[n // 10:]) / 1e3
        at = np.arange(len(late))
        line = np.polyfit(at, late, 1)
        doubt = float((late - np.polyval(line, at)).std() / (at.std() * np.sqrt(len(late))))
        resident_mb = [round(x / 1e6, 1) for x in (self.whole[n // 10], self.whole[-1], trimmed)]
        return [n, (n + EFFECT_EVERY - 1) // EFFECT_EVERY, self.named, round(seconds), round(float(late[0]) / 1e3, 1),
                round(float(late[-1]) / 1e3, 1), round(float(line[0]), 2), round(doubt, 2), *resident_mb, self.handles[0], self.handles[-1]]


def main() -> None:
    """Diagnose until the count or the time is reached or somebody stops it, print and record."""
    given = dict(argument.split("=") for argument in sys.argv[1:])
    seconds, count, started = float(given.get("seconds", 7200)), int(given.get("count", 2000)), time.monotonic()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    libc, counted = ctypes.CDLL(None), Counted()
    libc.mallinfo2.restype = Heap
    with TemporaryDirectory() as folder:
        place = Path(folder)
        healthy, rubbing = campaigns(place)
        try:
            while (n := len(counted.memory)) < count and time.monotonic() - started < seconds:
                campaign = verify_campaign(healthy if n % EFFECT_EVERY else rubbing)
                told = diagnose(campaign, None, n)
                counted.named += len(told.findings)
                if n % WRITTEN_EVERY == 0:
                    write_diagnosis(told, campaign, place / "out")
                del campaign, told
                for kept, value in ((counted.memory, in_use(libc)), (counted.whole, resident()),
                                    (counted.handles, len(os.listdir("/proc/self/fd")))):
                    kept.append(value)
                if (n + 1) % RECORDED_EVERY == 0:
                    row = counted.row(time.monotonic() - started, _trimmed(libc))
                    record("soak", dict(zip(COLUMNS, row, strict=True)))
                    print(*row, flush=True)
        except KeyboardInterrupt:
            print("stopped")
    row = counted.row(time.monotonic() - started, _trimmed(libc))
    show("soak", COLUMNS, [row])
    record("soak", dict(zip(COLUMNS, row, strict=True)))


if __name__ == "__main__":
    main()
