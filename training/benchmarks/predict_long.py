"""Where the time of `nnhydro predict` goes for a long recording: `python training/benchmarks/predict_long.py [ROWS]`.

Angles alone, as encoders give them, 300,000 rows by default: reading (CSV and Parquet), the prediction (filter, derivatives, torque) with
the model and with the model compiled, the compiling itself, writing. A minute.
"""

import sys
import tempfile
import time
from pathlib import Path

from machine import ARM, machine, versions

# isort: split
import numpy as np
import pandas as pd
import torch

from nnhydro.deployment.compiled.torque import compile_model
from nnhydro.models.baselines import baseline
from nnhydro.models.prediction import predict, write_prediction
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.readers.files import read_recording
from nnhydro.runtime.files import write_json

ROWS, RATE = 300_000, 100.0


def timed(call, best_of: int = 1):
    """Return the processor's seconds of `call`, the best of several, and what it returned."""
    best, made = float("inf"), None
    for _ in range(best_of):
        began = time.process_time()
        made = call()
        best = min(best, time.process_time() - began)
    return best, made


def main() -> None:
    """Print and store the times."""
    torch.set_num_threads(1)
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else ROWS
    t = np.arange(rows) / RATE
    q = np.stack([0.5 * np.sin(1.1 * t) + 0.3 * np.sin(0.37 * t), 0.6 * np.sin(0.9 * t + 1)], axis=1)
    q += 1e-4 * np.random.default_rng(0).standard_normal(q.shape)
    frame = pd.DataFrame({"t_s": t, "q1_rad": q[:, 0], "q2_rad": q[:, 1]})
    spent = {}
    with tempfile.TemporaryDirectory() as folder:
        csv, parquet = Path(folder) / "run.csv", Path(folder) / "run.parquet"
        frame.to_csv(csv, index=False)
        frame.to_parquet(parquet)
        spent["read CSV"], recording = timed(lambda: read_recording(csv, ARM, torque=False), 3)
        spent["read Parquet"], _ = timed(lambda: read_recording(parquet, ARM, torque=False), 3)
        for name in ("constant", "state"):
            model = StripTheory(ARM, Preparation(None), {}, name, baseline(name).start(ARM))
            spent[f"{name}: predict, the model itself"], plain = timed(lambda model=model: predict(model, recording), 2)
            spent[f"{name}: compile"], fast = timed(lambda model=model: compile_model(model))
            spent[f"{name}: predict, compiled"], quick = timed(lambda fast=fast: predict(fast, recording), 2)
            np.testing.assert_allclose(quick.tau, plain.tau, rtol=0, atol=1e-9)
        spent["write"], _ = timed(lambda: write_prediction(quick, Path(folder) / "out" / "run.csv"))
    print(f"{rows} rows; seconds of the processor, and what a million rows take")
    for name, seconds in spent.items():
        print(f"{name:36s} {seconds:7.2f} s" + ("" if name.endswith("compile") else f"   {1e6 * seconds / rows:7.2f} s"))
    print(machine("nnhydro", "numba", "numpy", "torch", "pandas"))
    write_json(Path(__file__).with_suffix(".json"), {"rows": rows, "seconds": spent, "machine": machine(),
                                                     "versions": versions("nnhydro", "numba", "numpy", "torch", "pandas")})


if __name__ == "__main__":
    main()
