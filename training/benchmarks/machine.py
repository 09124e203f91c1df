"""What the benchmarks share: the machine in words, fair timing, and the two-link arm of the tests."""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import platform  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable, Mapping  # noqa: E402
from importlib.metadata import PackageNotFoundError, version  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

from nnhydro.recordings.arm import Arm  # noqa: E402

ARM = Arm.model_validate({"name": "two-link-tank-arm", "fluid": {"density_kg_m3": 1000.0}, "links": [
    {"length_m": 0.55, "diameter_m": 0.07, "mass_kg": 1.0, "com_m": 0.27, "inertia_kg_m2": 0.026},
    {"length_m": 0.45, "diameter_m": 0.06, "mass_kg": 1.4, "com_m": 0.22, "inertia_kg_m2": 0.024}]})


def processor() -> str:
    """Return the processor's name and its widest vectors."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    facts = dict(line.split(":", 1) for line in lines if ":" in line)
    named = {key.strip(): value.strip() for key, value in facts.items()}
    wide = next((w for w in ("avx512f", "avx2") if w in named.get("flags", "").split()), "no AVX")
    return f"{named.get('model name', platform.machine())} ({wide})"


def versions(*names: str) -> dict[str, str]:
    """Return the installed versions of `names`; those that are missing are left out."""
    found = {"python": platform.python_version()}
    for name in names:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def machine(*names: str) -> str:
    """Return the machine and the versions of `names` in words."""
    load = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores" if hasattr(os, "getloadavg") else f"{os.cpu_count()} cores"
    return f"{processor()}, {load}, one thread; " + ", ".join(f"{k} {v}" for k, v in versions(*names).items())


def seconds(calls: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, float]:
    """Return the processor's seconds of each call: the best of several rounds, all calls in each, so that a busy machine hits all alike."""
    best = dict.fromkeys(calls, float("inf"))
    for call in calls.values():
        call()  # first allocations
    for _ in range(rounds):
        for name, call in calls.items():
            began = time.process_time()
            call()
            best[name] = min(best[name], time.process_time() - began)
    return best
