"""A newcomer's transcript: from a fresh clone to a verdict on his own CSV with foreign names and degrees, with the time of each step.

    python training/newcomer/run.py [--keep DIR]

His recordings are those of datasets/mclain_tank, as a logger would have written them: milliseconds, degrees and N cm under other names.
Prints every command, how its output ends and its seconds; writes results.json and transcript.txt beside this file.
"""

import csv
import json
import math
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
LINES = 14  # of a command's output that are shown
MAPPING = """columns:
  t_s: {from: Time (ms), unit: ms}
  q1_rad: {from: arm angle, unit: deg}
  tau1_Nm: {from: motor torque, unit: N cm}
"""


def logged(source: Path, folder: Path) -> None:
    """Write his recordings and his arm.yaml: what he brings with him."""
    (folder / "recordings").mkdir(parents=True)
    (folder / "arm.yaml").write_text((source / "arm.yaml").read_text())
    for file in sorted((source / "recordings").glob("*.csv")):
        rows = list(csv.DictReader(file.read_text().splitlines()))
        lines = [f"{1000 * float(r['t_s']):.0f},{math.degrees(float(r['q1_rad'])):.4f},{100 * float(r['tau1_Nm']):.3f}" for r in rows]
        (folder / "recordings" / file.name).write_text("\n".join(["Time (ms),arm angle,motor torque", *lines]) + "\n")


def main(place: Path) -> None:
    """Take every step in `place` and print the transcript."""
    nnhydro = place / "nnhydro" / ".venv" / "bin" / "nnhydro"
    said, times = [], []

    def tell(text: str) -> None:
        print(text, flush=True)
        said.append(text)

    def step(title: str, command: str, fails: bool = False) -> None:
        tell(f"\n# {title}\n$ {command}".replace(str(ROOT), "https://example.invalid/nnhydro.git"))
        start = time.perf_counter()
        done = subprocess.run(["bash", "-c", command.replace("nnhydro ", f"{nnhydro} ") if command.startswith("nnhydro ") else command],
                              cwd=place, capture_output=True, text=True, env={**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1"})
        seconds = time.perf_counter() - start
        out = [line.rstrip() for line in (done.stderr if fails else done.stdout).splitlines() if line.strip()]
        tell("\n".join(["  ...", *out[-LINES:]] if len(out) > LINES else out).replace(str(place) + "/", ""))
        tell(f"[{seconds:.1f} s]")
        times.append({"step": title, "seconds": round(seconds, 1)})
        if (done.returncode != 0) != fails:
            sys.exit(f"{title}: ended with {done.returncode}")

    logged(ROOT / "datasets" / "mclain_tank", place / "my_rig")
    tell("He has: my_rig/arm.yaml, my_rig/recordings/*.csv with the columns  Time (ms),arm angle,motor torque  in ms, degrees and N cm.")
    step("fetch it", f"git clone -q --no-local {ROOT} nnhydro")
    step("install it", "cd nnhydro && python3 -m venv .venv && .venv/bin/pip install -q .")
    step("ask whether his recordings can be read", "nnhydro check my_rig", fails=True)
    step("write down what the line asks for", f"cat > my_rig/columns.yaml <<'END'\n{MAPPING}END")
    step("ask again", "nnhydro check my_rig")
    step("compare the physics on recordings held out", "nnhydro benchmark my_rig --models textbook,constant --out compared")
    step("ask what is missing", "nnhydro diagnose my_rig --out diagnosis")
    step("look what it has left", "ls diagnosis")
    total = sum(step["seconds"] for step in times)
    load = os.getloadavg()[1]  # of the last five minutes: his own share is 1
    tell(f"\n{total:.0f} s from nothing to the verdict, {total - times[1]['seconds']:.0f} s of it without the installation "
         f"({platform.machine()}, {os.cpu_count()} cores under a load of {load:.1f}, Python {platform.python_version()}).")
    (HERE / "transcript.txt").write_text("\n".join(said) + "\n")
    result = {"steps": times, "seconds": round(total, 1), "machine": platform.machine(), "cores": os.cpu_count(), "load": round(load, 1),
              "python": platform.python_version()}
    (HERE / "results.json").write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "--keep":
        Path(sys.argv[2]).mkdir(parents=True)
        main(Path(sys.argv[2]).resolve())
    elif len(sys.argv) == 1:
        with tempfile.TemporaryDirectory() as folder:
            main(Path(folder).resolve())
    else:
        sys.exit(__doc__)
