"""Time of one state for a controller: `python training/benchmarks/single_state.py`.

A call of the model from Python, and a step of the exported model in onnxruntime (Python's `run`, and bound inputs and outputs), on one
thread, for physics alone, a small network and the hybrid as `nnhydro train` makes it, on datasets/rivera_tank. A minute or two.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import platform  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402
import onnxruntime  # noqa: E402
import torch  # noqa: E402

from nnhydro.deployment.onnx.onnx_file import PRECISIONS, export_onnx  # noqa: E402
from nnhydro.fitting.config import TrainingConfig  # noqa: E402
from nnhydro.fitting.identify import identify  # noqa: E402
from nnhydro.fitting.network.train import train  # noqa: E402
from nnhydro.models.torque_model import TorqueModel  # noqa: E402
from nnhydro.physics.motion import Motion  # noqa: E402
from nnhydro.recordings.campaign import open_campaign  # noqa: E402
from nnhydro.runtime.files import write_json  # noqa: E402

CAMPAIGN = Path("datasets/rivera_tank")
TARGET = 10.0  # microseconds
CALLS, ROUNDS = 50, 40  # the best round counts: others share the machine
SMALL = {"model": "network", "features": ("morison", "angles", "rates"), "law": (), "hidden": (32,), "members": 1, "epochs": 20}


def microseconds(call: Callable[[], Any], calls: int = CALLS, rounds: int = ROUNDS) -> float:
    """Return the time of one call, microseconds: the best of several rounds."""
    best = float("inf")
    for _ in range(rounds):
        began = time.perf_counter()
        for _ in range(calls):
            call()
        best = min(best, (time.perf_counter() - began) / calls)
    return 1e6 * best


def session(path: Path) -> onnxruntime.InferenceSession:
    """Return a session on one thread."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def in_onnxruntime(model: TorqueModel, precision: str) -> dict[str, float]:
    """Return microseconds a step by `run` and with everything bound."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.onnx"
        export_onnx(model, path, precision)
        made = session(path)
    random = np.random.default_rng(0)
    given = {x.name: (0.5 * random.standard_normal(x.shape)).astype(PRECISIONS[precision]) for x in made.get_inputs()}
    binding, held = made.io_binding(), []
    for name, value in given.items():
        held.append(onnxruntime.OrtValue.ortvalue_from_numpy(value))
        binding.bind_ortvalue_input(name, held[-1])
    for x, value in zip(made.get_outputs(), made.run(None, given), strict=True):
        held.append(onnxruntime.OrtValue.ortvalue_from_numpy(value))
        binding.bind_ortvalue_output(x.name, held[-1])
    return {"run_us": microseconds(lambda: made.run(None, given)), "bound_us": microseconds(lambda: made.run_with_iobinding(binding))}


def measured(model: TorqueModel) -> dict[str, Any]:
    """Return the times of one model."""
    motion = Motion.at(np.full((1, 2), 0.4), np.full((1, 2), 0.7), np.full((1, 2), 1.1), 0.3, 0.2)
    return {"python_us": microseconds(lambda: model.torque(motion), 5, 10), **{p: in_onnxruntime(model, p) for p in PRECISIONS}}


def main() -> None:
    """Print and store the times."""
    torch.set_num_threads(1)
    campaign = open_campaign(CAMPAIGN)
    models = {"constant (physics)": identify(campaign, "constant"), "small network": train(campaign, TrainingConfig(**SMALL)),
              "hybrid (as nnhydro train makes it)": train(campaign, TrainingConfig(epochs=4))}
    machine = f"{platform.machine()}, {os.cpu_count()} cores, one thread; onnxruntime {onnxruntime.__version__}, torch {torch.__version__}"
    heads = " ".join(f"{p + ' ' + way:>13s}" for p in PRECISIONS for way in ("run", "bound"))
    print(f"{'microseconds a state':36s} {'Python':>8s} {heads}")
    results = {name: measured(model) for name, model in models.items()}
    for name, r in results.items():
        print(f"{name:36s} {r['python_us']:8.0f} " + " ".join(f"{r[p][way]:13.1f}" for p in PRECISIONS for way in ("run_us", "bound_us")))
    reached = [name for name, r in results.items() if min(r[p]["bound_us"] for p in PRECISIONS) <= TARGET]
    print(f"within the target of {TARGET:g} microseconds: {', '.join(reached) or 'none'}; {machine}")
    write_json(Path(__file__).with_suffix(".json"), {"microseconds": results, "target_us": TARGET, "machine": machine})


if __name__ == "__main__":
    main()
