"""Learned models on an arm that no mirror image shows: `python training/asymmetric_arm/run.py [LINE ...]`, from the repository root.

    tension = k max(0, |anchor - tip| - slack),    tau_j += -d/dq_j (1/2 k max(0, |anchor - tip| - slack)^2)
"""

import json
import shutil
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd

from nnhydro.evaluation.benchmark import benchmark
from nnhydro.recordings.campaign import open_campaign
from nnhydro.runtime.files import write_json, write_text

HERE = Path(__file__).parent
STEP = 1e-5  # rad, of the numerical derivative
RIVALS = ("gp", "boosted-trees", "mlp-raw")


def energy(q: np.ndarray, lengths: list[float], line: dict) -> np.ndarray:
    """Energy (n,) J of the line at the angles q (n, 2) rad."""
    phi = np.cumsum(q, axis=1)
    tip = (np.array(lengths) * np.exp(1j * phi)).sum(axis=1)
    stretch = np.maximum(np.abs(complex(*line["anchor_m"]) - tip) - line["slack_m"], 0.0)
    return 0.5 * line["stiffness_N_m"] * stretch**2


def with_line(source: Path, target: Path, line: dict) -> None:
    """Write the campaign `source` to `target` with the drives holding against the line."""
    shutil.copytree(source, target, ignore=shutil.ignore_patterns("unseen", "answers", "strips", "*.py", "card.*"))
    lengths = open_campaign(target).arm.L
    for path in sorted((target / "recordings").glob("*.csv")):
        table = pd.read_csv(path)
        q = table[["q1_rad", "q2_rad"]].to_numpy()
        for j in range(2):
            step = np.eye(2)[j] * STEP
            table[f"tau{j + 1}_Nm"] += (energy(q + step, lengths, line) - energy(q - step, lengths, line)) / (2 * STEP)
        table.to_csv(path, index=False)


def page(results: dict) -> str:
    """The table."""
    lines = ["# An arm that no mirror image shows", "",
             "`python training/asymmetric_arm/run.py`: something fixed to the tank pulls at the tip of datasets/ns_tank's arm. Error in %,",
             "recordings left out; choices in `config.toml`, numbers in `results.json`.", ""]
    for name, errors in results.items():
        best = min(errors[rival] for rival in RIVALS if rival in errors)
        lines += [f"## {name}", "", "| model | error | over the best rival |", "| --- | --- | --- |"]
        ranked = sorted(errors.items(), key=lambda item: item[1])
        lines += [f"| {model} | {100 * error:.1f} | {error / best:.2f} |" for model, error in ranked]
        lines.append("")
    return "\n".join(lines)


def main() -> None:
    """Run the lines named on the command line, all by default."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    path = HERE / "results.json"
    results = json.loads(path.read_text()) if path.exists() else {}
    for name in sys.argv[1:] or config["lines"]:
        with tempfile.TemporaryDirectory() as folder:
            with_line(Path(config["campaign"]), Path(folder) / name, config["lines"][name])
            result = benchmark(open_campaign(Path(folder) / name), config["models"], config["folds"], config["seed"])
        results[name] = {model: standing.pooled.error for model, standing in result.standings.items()}
        write_json(path, results)
        write_text(HERE / "README.md", page(results))
        print(name, {model: round(100 * error, 1) for model, error in results[name].items()}, flush=True)


if __name__ == "__main__":
    main()
