"""A hybrid on the corrected model against a hybrid on the plain baseline: `python training/hybrid_on_corrected/run.py [KEY=VALUE ...]`.

A campaign for each of `effects`, hidden by the truth's code, is diagnosed; then two hybrids are trained on the same recordings, one on the
calibrated baseline, one on the diagnosed model. Told are errors on unseen motions against the noise-free truth (McLain and Rock's measure),
and the network's part: rms of what the hybrid adds to its baseline over rms torque, on the unseen motions. About two minutes an effect;
everything goes to runs/, and what is there is not made again. Writes results.json.
"""

import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nnhydro.blind_tests.conceal import MARKER, conceal
from nnhydro.blind_tests.reveal import read_suite
from nnhydro.blind_tests.seal import KEY_FILE, open_sealed, read_key
from nnhydro.blind_tests.truth.campaign import Wish
from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import versions
from nnhydro.fitting.network.train import train
from nnhydro.models.prediction import predict
from nnhydro.models.storage import load_model, save_model
from nnhydro.models.torque_model import TorqueModel
from nnhydro.recordings.arm import read_arm
from nnhydro.recordings.campaign import verify_campaign
from nnhydro.recordings.readers.files import read_recording
from nnhydro.runtime.files import write_json

Array = NDArray[np.float64]
HERE = Path(__file__).parent
RUNS = HERE / "runs"


def predicted(model: TorqueModel, campaign: Path, names: list[str]) -> Array:
    """Return the torques of `model` for the unseen motions, one after the other."""
    arm = read_arm(campaign / "arm.yaml")
    return np.concatenate([predict(model, read_recording(campaign / "unseen" / f"{name}.csv", arm, torque=False)).tau for name in names])


def models(campaign: Path, baseline: str, config: dict[str, Any]) -> dict[str, TorqueModel]:
    """Return the calibrated baseline, the corrected model and a hybrid on each, made where they are not there yet."""
    opened, place = verify_campaign(campaign), RUNS / "models" / campaign.name
    if not (place / "corrected").is_dir():
        found = diagnose(opened, baseline)
        print(f"  {found.verdict()}", flush=True)
        save_model(found.baseline, place / "baseline")
        save_model(found.corrected, place / "corrected")
    for name in ("baseline", "corrected"):
        if not (place / f"hybrid on {name}").is_dir():
            chosen = TrainingConfig(model="hybrid", baseline=str(place / name), members=config["members"], epochs=config["epochs"])
            save_model(train(opened, chosen), place / f"hybrid on {name}")
    return {name: load_model(place / name) for name in ("baseline", "corrected", "hybrid on baseline", "hybrid on corrected")}


def main() -> None:
    """Print one row an effect, and the medians."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    for key, _, value in (item.partition("=") for item in sys.argv[1:]):
        config[key] = type(config[key])(value)
    suite = RUNS / f"suite-{config['seed']}"
    effects = config["effects"].split(",")
    if not (suite / MARKER).is_file():
        conceal(suite, [Wish(name, "strong", 2, 1, "normal") for name in effects], config["seed"], progress=print)
    key, rows = read_key(suite / KEY_FILE), []
    heads = ("baseline", "corrected", "hybrid on baseline", "hybrid on corrected")
    print(f"{'hidden':>22} " + " ".join(f"{head:>20}" for head in heads) + f" {'network part: plain':>20} {'on corrected':>13}")
    for name, public in sorted(read_suite(suite).items()):
        answer = open_sealed(suite / "answers" / f"{name}.sealed", key, public["commitment"])
        motions = sorted(answer["unseen"])
        truth = np.concatenate([np.array(answer["unseen"][m]["tau_Nm"]) for m in motions])
        said = {k: predicted(model, suite / name, motions) for k, model in models(suite / name, public["baseline"], config).items()}
        errors = {k: float(np.abs(tau - truth).sum() / np.abs(truth).sum()) for k, tau in said.items()}
        rms = float(np.sqrt((truth**2).mean()))
        part = {k: float(np.sqrt(((said[f"hybrid on {k}"] - said[k]) ** 2).mean())) / rms for k in ("baseline", "corrected")}
        rows.append({"hidden": [e["effect"] for e in answer["effects"]], "errors": errors, "network_part": part})
        print(f"{','.join(rows[-1]['hidden']):>22} " + " ".join(f"{errors[head]:>20.4f}" for head in heads)
              + f" {part['baseline']:>20.4f} {part['corrected']:>13.4f}", flush=True)
    middle = {head: float(np.median([row["errors"][head] for row in rows])) for head in heads}
    parts = {k: float(np.median([row["network_part"][k] for row in rows])) for k in ("baseline", "corrected")}
    print(f"{'median':>22} " + " ".join(f"{middle[head]:>20.4f}" for head in heads)
          + f" {parts['baseline']:>20.4f} {parts['corrected']:>13.4f}")
    write_json(HERE / "results.json", {"rows": rows, "median": middle, "network_part": parts, "config": config, "versions": versions()})


if __name__ == "__main__":
    main()
