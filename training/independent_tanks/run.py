"""Learned models on tanks without a planted law: `python training/independent_tanks/run.py [SET[:PROTOCOL] ...] [models=A,B]`, from root.

Writes results.json and README.md after every benchmark; what is not named on the command line is kept.
"""

import json
import subprocess
import sys
import time
import tomllib
from pathlib import Path

from nnhydro.evaluation.benchmark import Benchmark, benchmark
from nnhydro.files import write_json, write_text
from nnhydro.recordings.campaign import open_campaign

HERE = Path(__file__).parent
BASES = ("constant", "state")
SHARES_AN_EQUATION = {"rivera_tank": "none exactly: the planted memory is of first order, those of features/wake.py are not"}


def worst_over_base(result: Benchmark, name: str) -> dict[str, float]:
    """Largest error of a model over that of the best and of the worst baseline, a recording each."""
    own, bases = result.standings[name].misfit, [result.standings[base].misfit for base in BASES]
    best = {unit: own[unit].error / min(base[unit].error for base in bases) for unit in own}
    plain = {unit: own[unit].error / bases[0][unit].error for unit in own}
    return {"over_best_baseline": max(best.values()), "over_constant": max(plain.values()),
            "worse_than_1.1_constant": sum(ratio > 1.1 for ratio in plain.values()), "recordings": len(own)}


def commit() -> str:
    """The commit that made the figures."""
    return subprocess.run(["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=False, cwd=HERE).stdout.strip()


def table(results: dict) -> str:
    """The page."""
    lines = ["# Learned models on independent tanks", "",
             "`python training/independent_tanks/run.py`; every choice stands in `config.toml`, every number in `results.json`.",
             "error = sum |tau - model| / sum |tau| in %, on recordings (or whole kinds of motion) held out of the fit. Which feature",
             "shares an equation with the data: none, except as said below.",
             "`95 %`: share of held-out rows within the model's 95 % intervals.", ""]
    for key, entry in results.items():
        name = key.split(":")[0]
        lines += [f"## {key.replace(':', ', ')}", "", "| model | error | fit s | worst recording over constant | 95 % |",
                  "| --- | --- | --- | --- | --- |"]
        for model, own in sorted(entry["models"].items(), key=lambda item: item[1]["error"]):
            worst = entry["worst"].get(model)
            covered = own.get("coverage", {}).get("shares", {}).get("95")
            cells = ("" if worst is None else f"{worst['over_constant']:.2f}", "" if covered is None else f"{100 * covered:.0f}")
            lines.append(f"| {model} | {100 * own['error']:.1f} | {own['fit_s']:.0f} | {cells[0]} | {cells[1]} |")
        if name in SHARES_AN_EQUATION:
            lines += ["", f"Which feature shares its equation: {SHARES_AN_EQUATION[name]}."]
        lines += ["", f"Made by {entry['commit']} in {entry['seconds']} s.", ""]
    return "\n".join(lines)


def main() -> None:
    """Run the benchmarks named on the command line, all by default."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    path = HERE / "results.json"
    results = json.loads(path.read_text()) if path.exists() else {}
    every = [f"{name}:{protocol}" for name, one in config["sets"].items() for protocol in one["protocols"]]
    given = [word.removeprefix("models=").split(",") for word in sys.argv[1:] if word.startswith("models=")]
    asked = [word for word in sys.argv[1:] if not word.startswith("models=")] or every
    for key in (key for key in every if key in asked or key.split(":")[0] in asked):
        name, protocol = key.split(":")
        chosen, start = config["sets"][name], time.perf_counter()
        models = given[0] if given else chosen.get("models", config["models"])
        result = benchmark(open_campaign(Path(chosen["campaign"])), models, config["folds"], config["seed"], protocol=protocol)
        entry = result.document()
        worst = {model: worst_over_base(result, model) for model in result.standings if model not in BASES}
        results[key] = entry | {"worst": worst, "seconds": round(time.perf_counter() - start), "commit": commit()}
        write_json(path, results)
        write_text(HERE / "README.md", table(results))
        print(key, {model: round(100 * own["error"], 2) for model, own in entry["models"].items()}, flush=True)


if __name__ == "__main__":
    main()
