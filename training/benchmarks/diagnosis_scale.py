"""`nnhydro diagnose` against the number of recordings: `python training/benchmarks/diagnosis_scale.py [100 1000 10000]`.

Recordings of 1,000 rows with a hidden Coulomb friction of 0.1 N m, written as Parquet into a temporary folder, one process a campaign: wall
and processor's seconds, the most memory that was used, and what was named. 10,000 recordings take about 700 MB of disk and some minutes.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from machine import ARM, machine, versions  # isort: skip  one thread, set before numpy and torch are imported
import numpy as np
import pandas as pd
import yaml

from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.runtime.files import write_json

COUNTS = (100, 1_000, 10_000)
ROWS, RATE = 1_000, 100.0
NOISE, FRICTION = 0.02, 0.1  # N m
WORK = """
import json, resource, sys, time
from pathlib import Path
from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.recordings.campaign import verify_campaign
wall, cpu = time.perf_counter(), time.process_time()
d = diagnose(verify_campaign(Path(sys.argv[1])), "constant").document()
print(json.dumps({"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu,
                  "memory_MiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
                  "named": [[f["effect"], f["joint"]] for f in d["findings"]], "proof_recordings": d["proof"]["recordings"]}))
"""


def recording(model: StripTheory, rng: np.random.Generator) -> pd.DataFrame:
    """Return a recording of three sines a joint, every derivative given."""
    t = np.arange(ROWS) / RATE
    w, a = 2 * np.pi * rng.uniform(0.1, 0.8, (3, 2)), rng.uniform(0.1, 0.4, (3, 2))
    phase = w * t[:, None, None]
    q = rng.uniform(-1.5, 1.5, 2) + (a * (1 - np.cos(phase))).sum(1)
    qd, qdd, zero = (a * w * np.sin(phase)).sum(1), (a * w**2 * np.cos(phase)).sum(1), np.zeros(ROWS)
    tau = model.torque(Motion(tensor(t), tensor(q), tensor(qd), tensor(qdd), tensor(zero), tensor(zero))).numpy()
    tau = tau + FRICTION * np.tanh(qd / 0.02) * [1.0, 0.0] + NOISE * rng.standard_normal((ROWS, 2))
    columns = {f"{name}{j + 1}_{unit}": x[:, j] for name, unit, x in
               (("q", "rad", q), ("dq", "rad_s", qd), ("ddq", "rad_s2", qdd), ("tau", "Nm", tau)) for j in range(2)}
    return pd.DataFrame({"t_s": t, **columns})


def campaign(folder: Path, count: int) -> Path:
    """Write a campaign of `count` recordings into `folder`."""
    model = StripTheory(ARM, Preparation(None), {}, "truth", Loads({
        "rigid_body": RigidBody.of_arm(ARM), "normal_drag": NormalDrag((1.1, 1.1)), "added_mass": AddedMass((0.9, 0.9))}))
    (folder / "recordings").mkdir(parents=True)
    (folder / "arm.yaml").write_text(yaml.safe_dump(ARM.document()))
    for number in range(count):
        recording(model, np.random.default_rng([7, number])).to_parquet(folder / "recordings" / f"run_{number:05d}.parquet")
    return folder


def main() -> None:
    """Print one row per campaign and write diagnosis_scale.json."""
    rows = []
    print(f"{'recordings':>10} {'wall s':>8} {'cpu s':>8} {'MiB':>7}   named")
    for count in [int(x) for x in sys.argv[1:]] or COUNTS:
        with tempfile.TemporaryDirectory() as temporary:
            path = campaign(Path(temporary) / "campaign", count)
            done = subprocess.run([sys.executable, "-c", WORK, str(path)], capture_output=True, text=True, check=True)
        rows.append({"recordings": count} | json.loads(done.stdout))
        said = ", ".join(f"{effect} joint {joint}" for effect, joint in rows[-1]["named"]) or "nothing"
        print(f"{count:>10} {rows[-1]['wall_s']:>8.1f} {rows[-1]['cpu_s']:>8.1f} {rows[-1]['memory_MiB']:>7.0f}   {said}", flush=True)
    write_json(Path(__file__).with_suffix(".json"), {"rows": rows, "machine": machine(), "versions": versions()})


if __name__ == "__main__":
    main()
