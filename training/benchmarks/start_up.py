"""Time until the command answers: `python training/benchmarks/start_up.py`.

`import nnhydro`, `nnhydro --help` and the help of a command in fresh interpreters; the interpreter's own start is in the figures and
printed beside them. The best of many counts: as wall time, which is what a user waits for, and as the processor's seconds, which a busy
machine does not stretch. Five seconds.
"""

import resource
import subprocess
import sys
import time
from pathlib import Path

from machine import machine, versions

from nnhydro.runtime.files import write_json

REPEATS, WANTED = 15, 0.3  # s
COMMANDS = {"python": ["-c", "pass"], "import typer": ["-c", "import typer"], "import nnhydro": ["-c", "import nnhydro"],
            "nnhydro --help": ["-m", "nnhydro", "--help"], "nnhydro check --help": ["-m", "nnhydro", "check", "--help"]}


def processor() -> float:
    """Return the seconds that finished child processes have spent."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def best(arguments: list[str]) -> dict[str, float]:
    """Return the best wall time and the best processor time of several starts, s."""
    found = {"wall": float("inf"), "processor": float("inf")}
    for _ in range(REPEATS):
        began, before = time.perf_counter(), processor()
        subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
        found = {"wall": min(found["wall"], time.perf_counter() - began), "processor": min(found["processor"], processor() - before)}
    return found


def main() -> None:
    """Print and store the times."""
    spent = {name: best(arguments) for name, arguments in COMMANDS.items()}
    for name, times in spent.items():
        wanted = f"   wanted < {WANTED:g}" if "nnhydro" in name else ""
        print(f"{name:22s} {times['wall']:6.3f} s, of the processor {times['processor']:6.3f} s{wanted}")
    print(machine("nnhydro"))
    write_json(Path(__file__).with_suffix(".json"),
               {"seconds": spent, "wanted": WANTED, "machine": machine(), "versions": versions("nnhydro")})


if __name__ == "__main__":
    main()
