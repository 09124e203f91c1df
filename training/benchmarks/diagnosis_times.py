"""What the long commands take, beside another version: `python training/benchmarks/diagnosis_times.py [OTHER_CHECKOUT] [LINE ...]`.

Each line is a command on a campaign made here with a fixed seed (kept out of git in runs/), run as a process of its own with one thread:
seconds of the processor, the most memory, what was named. With OTHER_CHECKOUT (a clone of the repository at another commit) both
versions run one after the other on the same files, and the ratio is told; version 0.1 of docs/speed.md is a5379f3. A run of more than
LIMIT seconds is stopped. LINE: parts of names of lines.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from machine import machine  # isort: skip  one thread, set before numpy and torch are imported
import numpy as np
import pandas as pd
import yaml
from diagnosis_peers import SEED, suite
from diagnosis_scale import campaign as many_recordings

from nnhydro.blind_tests.reveal import read_suite
from nnhydro.blind_tests.truth.campaign import SIZES, Wish
from nnhydro.runtime.files import write_json

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
RUNS = HERE / "runs" / "times"
LIMIT = 400.0  # s
FAST_SAMPLED = 3, 60.0, 1000.0  # recordings, s, Hz
sys.path.insert(0, str(ROOT / "training" / "independent_arms"))


def hidden(effect: str) -> Path:
    """Return a concealed campaign of 20 recordings of 1,000 rows."""
    SIZES["speed"] = ((20, 20), (10.0, 10.0), (100.0,))
    folder = suite(f"times_{effect}_{SEED}", [Wish(effect, "strong", 2, 1, "speed")])
    return folder / next(iter(read_suite(folder)))


def slack_line() -> Path:
    """Return ns_tank's arm with a slack mooring line (training/asymmetric_arm)."""
    sys.path.insert(0, str(ROOT / "training" / "asymmetric_arm"))
    from run import changed  # type: ignore[attr-defined]

    made = RUNS / "slack_line"
    if not made.exists():
        line = {"anchor_m": [0.6, -0.3], "slack_m": 0.5, "stiffness_N_m": 20.0}
        changed(ROOT / "datasets" / "ns_tank", made, line)
    return made


def rubbing(rate: float) -> Path:
    """Return three recordings of a minute of a dry arm with Coulomb friction at joint 1, sampled at `rate` Hz."""
    made = RUNS / f"rubbing_{rate:.0f}"
    if made.exists():
        return made
    count, seconds, finest = FAST_SAMPLED
    (made / "recordings").mkdir(parents=True)
    link = {"length_m": 0.5, "diameter_m": 0.05, "mass_kg": 2.0, "com_m": 0.25, "inertia_kg_m2": 0.05}
    arm = {"schema": "nnhydro/arm/1", "name": "one dry link", "fluid": {"density_kg_m3": 0.0}, "links": [link], "gravity_m_s2": 9.81}
    (made / "arm.yaml").write_text(yaml.safe_dump(arm))
    for k in range(count):
        rng, t = np.random.default_rng(k), np.arange(round(seconds * finest)) / finest
        w, a, p = 2 * np.pi * rng.uniform(0.1, 0.8, 4), rng.uniform(0.1, 0.5, 4), rng.uniform(0, 6.28, 4)
        q = (a * np.sin(w * t[:, None] + p)).sum(axis=1)
        qd, qdd = (a * w * np.cos(w * t[:, None] + p)).sum(axis=1), -(a * w**2 * np.sin(w * t[:, None] + p)).sum(axis=1)
        tau = (0.05 + 2.0 * 0.25**2) * qdd + 2.0 * 9.81 * 0.25 * np.cos(q) + 0.4 * np.tanh(qd / 0.01) + 0.02 * rng.standard_normal(len(t))
        step = round(finest / rate)
        pd.DataFrame({"t_s": t, "q1_rad": q, "tau1_Nm": tau})[::step].to_csv(made / "recordings" / f"run{k}.csv", index=False)
    return made


def thousand() -> Path:
    """Return 1,000 recordings of 1,000 rows."""
    made = RUNS / "thousand"
    return made if made.exists() else many_recordings(made, 1000)


LINES: dict[str, tuple[str, Callable[[], Path]]] = {
    "outsider, friction": ("diagnose", lambda: ROOT / "datasets" / "foreign" / "case_003"),
    "outsider, slow": ("diagnose", lambda: ROOT / "datasets" / "foreign" / "case_030"),
    "20 x 1,000, wave": ("diagnose", lambda: hidden("wave_orbital")),
    "20 x 1,000, shedding": ("diagnose", lambda: hidden("vortex_shedding")),
    "slack line": ("diagnose", slack_line),
    "3 x 60 s at 1 kHz": ("diagnose", lambda: rubbing(1000.0)),
    "3 x 60 s at 50 Hz": ("diagnose", lambda: rubbing(50.0)),
    "1,000 recordings": ("diagnose", thousand),
    "benchmark, 12 x 1,000": ("benchmark", lambda: HERE / "runs" / "times" / "twelve"),
}


def twelve() -> None:
    """Make the campaign of the benchmark: twelve of the thousand recordings."""
    made = RUNS / "twelve"
    if not made.exists():
        many_recordings(made, 12)


def timed(checkout: Path, command: str, campaign: Path) -> dict[str, Any]:
    """Return seconds, memory and findings of `nnhydro COMMAND CAMPAIGN` as the package in `checkout` does it."""
    with tempfile.TemporaryDirectory() as out:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        call = ["/usr/bin/env", "time", "-v"] if Path("/usr/bin/time").exists() else []
        env = {**os.environ, "PYTHONPATH": str(checkout), "MPLBACKEND": "Agg"}
        try:
            done = subprocess.run([*call, sys.executable, "-m", "nnhydro", command, str(campaign), "--out", f"{out}/made"], cwd=checkout,
                                  env=env, capture_output=True, text=True, timeout=LIMIT)
        except subprocess.TimeoutExpired:
            return {"seconds": None, "named": f"not ended in {LIMIT:.0f} s"}
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        told = Path(out) / "made" / "diagnosis.json"
        named = ([f"{f['effect']}@{f['joint']}" for f in json.loads(told.read_text())["findings"]] if told.exists()
                 else f"exit {done.returncode}")
        peak = [line for line in done.stderr.splitlines() if "Maximum resident" in line]
        return {"seconds": seconds, "MiB": int(peak[0].split()[-1]) / 1024 if peak else None, "named": named}


def main() -> None:
    """Print a line a command and write diagnosis_times.json."""
    given = sys.argv[1:]
    other = Path(given.pop(0)).resolve() if given and Path(given[0]).is_dir() else None
    kept = Path(__file__).with_suffix(".json")
    rows = json.loads(kept.read_text())["rows"] if kept.exists() else []  # lines that are not run again keep their figures
    twelve()
    for name, (command, made) in LINES.items():
        if given and not any(part in name for part in given):
            continue
        campaign = made()
        now = timed(ROOT, command, campaign)
        row: dict[str, Any] = {"line": name, "now": now}
        text = f"{name:24s} {now['seconds'] or LIMIT:6.1f} s  {now.get('MiB') or 0:5.0f} MiB  {now['named']}"
        if other is not None:
            row["other"] = then = timed(other, command, campaign)
            row["ratio"] = None if None in (then["seconds"], now["seconds"]) else then["seconds"] / now["seconds"]
            text += f"   other: {then['seconds'] or LIMIT:6.1f} s  {then['named']}"
        rows = [*(kept_row for kept_row in rows if kept_row["line"] != name), row]
        print(text, flush=True)
        write_json(kept, {"rows": rows, "machine": machine("nnhydro", "torch", "numpy")})


if __name__ == "__main__":
    main()
