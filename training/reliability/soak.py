"""Do memory and file handles stay flat? `python training/reliability/soak.py [seconds=600 count=2000]`: diagnoses in a loop, one process.

Each round reads a small campaign, diagnoses it with a seed of its own and writes the results. After the first tenth (libraries fill their
caches) a straight line is laid through the memory in use, as glibc counts it: its slope, in kB a diagnosis, is what a leak would show in.
The resident memory holds besides what was freed and not given back; how much shows when it is asked for at the end (malloc_trim).
"""

import ctypes
import gc
import os
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from trials import prepare, record, show

from nnhydro.diagnosis.engine import diagnose
from nnhydro.recordings.campaign import verified
from nnhydro.report.diagnosis_folder import write_diagnosis

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


def main() -> None:
    """Diagnose until the count or the time is reached, print and record."""
    given = dict(argument.split("=") for argument in sys.argv[1:])
    seconds, count, started = float(given.get("seconds", 600)), int(given.get("count", 2000)), time.monotonic()
    libc, memory, handles, whole = ctypes.CDLL(None), [], [], []
    libc.mallinfo2.restype = Heap
    with TemporaryDirectory() as folder:
        place = Path(folder)
        prepare(place)
        while len(memory) < count and time.monotonic() - started < seconds:
            campaign = verified(place / "tank")
            write_diagnosis(diagnose(campaign, None, len(memory)), campaign, place / "out")
            del campaign
            memory.append(in_use(libc))
            whole.append(resident())
            handles.append(len(os.listdir("/proc/self/fd")))
    late = np.array(memory[len(memory) // 10:]) / 1e3
    n = np.arange(len(late))
    slope = float(np.polyfit(n, late, 1)[0])
    scatter = late - np.polyval(np.polyfit(n, late, 1), n)
    doubt = float(scatter.std() / (n.std() * np.sqrt(len(late))))
    columns = ["diagnoses", "seconds", "in use after the first tenth, MB", "in use at the end, MB", "slope, kB a diagnosis",
               "its standard error",
               "resident after the first tenth, MB", "resident at the end, MB", "resident when trimmed, MB", "file handles at first",
               "file handles at the end"]
    resident_mb = [round(x / 1e6, 1) for x in (whole[len(memory) // 10], whole[-1], _trimmed(libc))]
    row = [len(memory), round(time.monotonic() - started), round(float(late[0]) / 1e3, 1), round(float(late[-1]) / 1e3, 1), round(slope, 2),
           round(doubt, 2), *resident_mb, handles[0], handles[-1]]
    show("soak", columns, [row])
    record("soak", dict(zip(columns, row, strict=True)))


if __name__ == "__main__":
    main()
