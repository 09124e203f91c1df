"""What the reliability studies share: small campaigns to work on, a command in a child process, and results.json."""

import hashlib
import json
import os
import platform
import signal
import sys
import time
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from nnhydro.cli.main import run
from nnhydro.runtime.files import write_json

HERE = Path(__file__).resolve().parent
RECIPE = """schema: nnhydro/recipe/1
seed: 1
arm: {schema: nnhydro/arm/1, fluid: {density_kg_m3: 1000.0}, links: [
  {length_m: 0.55, diameter_m: 0.07, mass_kg: 1.0, com_m: 0.27, inertia_kg_m2: 0.026}]}
terms: {rigid_body: arm, normal_drag: {C_D: 1.0}, added_mass: {C_M: 0.8}}
sensors: {encoder_counts_per_rev: 65536, torque_noise_Nm: 0.02}
motions:
  - {kind: fourier, name: swim1, q_rad: [0.0], duration_s: 6.0, reach_rad: [1.2], rate_rad_s: 2.0}
  - {kind: fourier, name: swim2, q_rad: [0.4], duration_s: 6.0, reach_rad: [1.0], rate_rad_s: 1.5}
  - {kind: slew, name: reach, q_rad: [[-0.8], [0.7], [0.1]], duration_s: 1.2, pause_s: 0.4}
  - {kind: fourier, name: swim3, q_rad: [0.2], duration_s: 6.0, reach_rad: [0.8], rate_rad_s: 1.2}
unseen: [reach]
"""
TRAINING = 'model = "network"\nhidden = [8]\nmembers = 2\nepochs = 60\nbatch = 128\npatience = 1000\n'


def prepare(place: Path) -> None:
    """Write what the commands work on into the folder `place`: a recipe, its campaign, a concealed campaign, a training's choices."""
    (place / "recipe.yaml").write_text(RECIPE, encoding="utf-8")
    (place / "training.toml").write_text(TRAINING, encoding="utf-8")
    for arguments in (["simulate", str(place / "recipe.yaml"), "--out", str(place / "tank")],
                      ["conceal", "--out", str(place / "suite"), "--size", "small", "--links", "1", "--seed", "3", "--effect", "none"]):
        if run([*arguments, "--quiet"]):
            raise SystemExit("the small campaigns could not be made")


def child(arguments: Sequence[str], log: Path, before: Callable[[], object] = lambda: None) -> int:
    """Start `nnhydro arguments` in a child that has everything imported already, its output into `log`; return its process id."""
    sys.stdout.flush()
    pid = os.fork()
    if pid:
        return pid
    handle = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(handle, 1)
    os.dup2(handle, 2)
    code = 70
    try:
        before()
        code = run(list(arguments))
    finally:
        os._exit(code)


def ended(pid: int) -> int:
    """Return the exit code of the child, negative where a signal ended it."""
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def killed(pid: int, after: float) -> bool:
    """Kill the child -9 after so many seconds; return whether it was still at work."""
    end = time.monotonic() + after
    while time.monotonic() < end:
        if os.waitpid(pid, os.WNOHANG)[0]:
            return False
        time.sleep(min(0.002, max(end - time.monotonic(), 0)))
    os.kill(pid, signal.SIGKILL)
    return ended(pid) == -signal.SIGKILL


def tree(folder: Path) -> dict[str, str]:
    """Return sha256 by relative name of every file below `folder`."""
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.rglob("*"))
            if path.is_file()}


def record(study: str, document: dict[str, Any]) -> None:
    """Write `document` into results.json under the name of the study, beside what the other studies wrote."""
    path = HERE / "results.json"
    kept = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    machine = {"processors": os.cpu_count(), "python": platform.python_version(), "system": platform.system(),
               **{name: version(name) for name in ("numpy", "torch", "pyarrow", "h5py")}}
    write_json(path, kept | {study: document | {"machine": machine}})


def show(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print the rows as a table that Markdown understands."""
    print(f"\n{title}\n\n| {' | '.join(columns)} |\n| {' | '.join('---' for _ in columns)} |")
    for row in rows:
        print(f"| {' | '.join(map(str, row))} |")
