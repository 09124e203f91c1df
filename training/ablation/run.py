"""Which inputs of the network reduce its error on rivera_tank: `python training/ablation/run.py`. Writes results.json and README.md.

Each feature set is tried alone, without any law of the strips, and left out of all; each set of the law's variables is left out, and the
law as a whole. The error is that of leave-recordings-out.
"""

import time
import tomllib
from pathlib import Path

from nnhydro.evaluation.benchmark import benchmark
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import versions
from nnhydro.recordings.campaign import open_campaign
from nnhydro.runtime.files import write_json, write_text

HERE = Path(__file__).parent
START = TrainingConfig()
PAGE = """# Which inputs of the network reduce its error

**Measured with nnhydro {version}; figures of another version may differ.**

`python training/ablation/run.py` ({minutes} minutes): error of the network on held-out recordings of {campaign}, {folds} folds.
With all inputs the error is {all:.2f} %, without the law of the strips {lawless:.2f} %. With the law, but no feature except the
constants of the arm, it is {featureless:.2f} %. A feature set is useful if the error rises without it.

| feature set | alone, without the law | all but it | rises by |
| --- | --- | --- | --- |
{features}

| variables of the law | all but them | rises by |
| --- | --- | --- |
{law}
"""


def study(campaign, config):
    """Return the pooled held-out errors {name: error}: of a set left out, `alone SET`, `everything`, `lawless` and `featureless`."""
    def error(name, features=START.features, law=START.law):
        chosen = TrainingConfig(features=features, law=law, members=config["members"], epochs=config["epochs"], seed=config["seed"])
        result = benchmark(campaign, [config["model"]], config["folds"], config["seed"], chosen)
        found[name] = result.standings[config["model"]].pooled.error
        print(f"{name}: {100 * found[name]:.2f} %", flush=True)

    found: dict[str, float] = {}
    error("everything")
    error("lawless", law=())
    error("featureless", features=("arm",))
    for name in START.law:
        error(name, law=tuple(other for other in START.law if other != name))
    for name in START.features:
        error(name, features=tuple(other for other in START.features if other != name))
        if name != "arm":  # constants of one arm tell nothing alone
            error(f"alone {name}", features=(name,), law=())
    return found


def main():
    """Run the study, print the errors, write results.json and README.md."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    campaign, start = open_campaign(Path(config["campaign"])), time.perf_counter()
    found = study(campaign, config)
    seconds = time.perf_counter() - start

    def row(name, *cells):
        return f"| {' | '.join((name, *cells))} | {100 * found[name]:.2f} % | {100 * (found[name] / found['everything'] - 1):+.0f} % |"

    def alone(name):
        return f"{100 * found[f'alone {name}']:.1f} %" if f"alone {name}" in found else ""

    features, law = (sorted(names, key=lambda name: -found[name]) for names in (START.features, START.law))
    write_text(HERE / "README.md", PAGE.format(
        version=versions()["nnhydro"], minutes=round(seconds / 60),
        campaign=config["campaign"], folds=config["folds"], all=100 * found["everything"],
        lawless=100 * found["lawless"], featureless=100 * found["featureless"], law="\n".join(map(row, law)),
        features="\n".join(row(name, alone(name)) for name in features)))
    write_json(HERE / "results.json", {"errors": found, "seconds": round(seconds), "config": config,
                                       "versions": versions() | {"campaign_sha256": campaign.sha256()}})


if __name__ == "__main__":
    main()
