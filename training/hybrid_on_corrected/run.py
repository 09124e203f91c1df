"""A hybrid on the corrected model against a hybrid on the plain baseline: `python training/hybrid_on_corrected/run.py [KEY=VALUE ...]`.

A campaign for each of `effects`, hidden by the truth's code, is diagnosed; then two hybrids are trained on the same recordings, one on the
calibrated baseline, one on the diagnosed model. Told are errors on unseen motions against the noise-free truth (McLain and Rock's measure),
and the network's part: rms of what the hybrid adds to its baseline over rms torque, on the unseen motions. A quarter of a minute an effect;
everything goes to runs/VERSION, and what is there is not made again, so that one version makes a table. Writes results.json, and prints the
table of README.md. `python training/hybrid_on_corrected/run.py table` only prints the table of the stored results.
"""

import json
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
RUNS = HERE / "runs" / versions()["nnhydro"]
MODELS = ("baseline", "corrected", "hybrid on baseline", "hybrid on corrected")


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
    return {name: load_model(place / name) for name in MODELS}


def table(document: dict[str, Any]) -> str:
    """Return results.json as the Markdown table of README.md: a row for each hidden effect, and the medians."""
    rows = [(", ".join(row["hidden"]), row["errors"], row["network_part"]) for row in document["rows"]]
    rows.append(("**median**", document["median"], document["network_part"]))
    lines = ["| hidden | baseline | corrected model | hybrid on baseline | hybrid on corrected | network's part, plain | on corrected |",
             "| --- | --- | --- | --- | --- | --- | --- |"]
    for hidden, errors, part in rows:
        figures = [*(errors[model] for model in MODELS), part["baseline"], part["corrected"]]
        lines.append(f"| {hidden} | " + " | ".join(f"{figure:.4f}" for figure in figures) + " |")
    return "\n".join(lines)


def main() -> None:
    """Diagnose and train for every effect, and print the table."""
    if "table" in sys.argv[1:]:
        print(table(json.loads((HERE / "results.json").read_text())))
        return
    config = tomllib.loads((HERE / "config.toml").read_text())
    for key, _, value in (item.partition("=") for item in sys.argv[1:]):
        config[key] = type(config[key])(value)
    suite = RUNS / f"suite-{config['seed']}"
    effects = config["effects"].split(",")
    if not (suite / MARKER).is_file():
        conceal(suite, [Wish(name, "strong", 2, 1, "normal") for name in effects], config["seed"], progress=print)
    key, rows = read_key(suite / KEY_FILE), []
    for name, public in sorted(read_suite(suite).items()):
        answer = open_sealed(suite / "answers" / f"{name}.sealed", key, public["commitment"])
        motions = sorted(answer["unseen"])
        truth = np.concatenate([np.array(answer["unseen"][m]["tau_Nm"]) for m in motions])
        said = {k: predicted(model, suite / name, motions) for k, model in models(suite / name, public["baseline"], config).items()}
        errors = {k: float(np.abs(tau - truth).sum() / np.abs(truth).sum()) for k, tau in said.items()}
        rms = float(np.sqrt((truth**2).mean()))
        part = {k: float(np.sqrt(((said[f"hybrid on {k}"] - said[k]) ** 2).mean())) / rms for k in ("baseline", "corrected")}
        rows.append({"hidden": [e["effect"] for e in answer["effects"]], "errors": errors, "network_part": part})
        print(f"  {', '.join(rows[-1]['hidden'])}: " + ", ".join(f"{model} {error:.4f}" for model, error in errors.items()), flush=True)
    middle = {model: float(np.median([row["errors"][model] for row in rows])) for model in MODELS}
    parts = {k: float(np.median([row["network_part"][k] for row in rows])) for k in ("baseline", "corrected")}
    document = {"rows": rows, "median": middle, "network_part": parts, "config": config, "versions": versions()}
    write_json(HERE / "results.json", document)
    print(table(document))


if __name__ == "__main__":
    main()
