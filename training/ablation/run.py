"""Which inputs of the network reduce its error on rivera_tank: `python training/ablation/run.py`. Writes results.json and README.md.

Each feature set is tried alone, without any law of the strips, and left out of all; each set of the law's variables is left out, and the
law as a whole. The error is that of leave-recordings-out.
"""

import time
import tomllib
from pathlib import Path

from nnhydro.evaluation.benchmark import BenchmarkOptions
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
constants of the arm, the error is {featureless:.2f} %. An input is useful if the error rises without it. Each error is that of one seed.

The tank is synthetic, and made by this project. `interference` and `shadow` follow the geometry of the wake that it plants. Their gain here
is therefore not independent evidence ([record 0004](../../docs/decisions/0004-the-learned-law-of-the-strips-stands.md)).

| left out | is | error without it | rises by | error with it alone, without the law |
| --- | --- | --- | --- | --- |
{rows}
"""


def study(campaign, config):
    """Return the pooled held-out errors {name: error}: of a set left out, `alone SET`, `everything`, `lawless` and `featureless`."""
    def error(name, features=START.features, law=START.law):
        chosen = TrainingConfig(features=features, law=law, members=config["members"], epochs=config["epochs"], seed=config["seed"])
        result = BenchmarkOptions([config["model"]], config["folds"], config["seed"], chosen).benchmark(campaign)
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


def page(results):
    """Return README.md, with the table of `results` as results.json holds them; the largest rise comes first."""
    found, config = results["errors"], results["config"]

    def row(name, kind):
        alone = f"{100 * found[f'alone {name}']:.1f} %" if f"alone {name}" in found else ""
        rise = found[name] / found["everything"] - 1
        return f"| {name} | {kind} | {100 * found[name]:.2f} % | {100 * rise:+.0f} % | {alone} |"

    known = [(name, "feature set" if f"alone {name}" in found or name == "arm" else "variables of the law") for name in found
             if name not in ("everything", "lawless", "featureless") and not name.startswith("alone ")]
    return PAGE.format(
        version=results["versions"]["nnhydro"].partition("+")[0], minutes=round(results["seconds"] / 60), campaign=config["campaign"],
        folds=config["folds"], all=100 * found["everything"], lawless=100 * found["lawless"], featureless=100 * found["featureless"],
        rows="\n".join(row(*each) for each in sorted(known, key=lambda each: -found[each[0]])))


def main():
    """Run the study, print the errors, write results.json and README.md."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    campaign, start = open_campaign(Path(config["campaign"])), time.perf_counter()
    found = study(campaign, config)
    results = {"errors": found, "seconds": round(time.perf_counter() - start), "config": config,
               "versions": versions() | {"campaign_sha256": campaign.sha256()}}
    write_json(HERE / "results.json", results)
    write_text(HERE / "README.md", page(results))


if __name__ == "__main__":
    main()
