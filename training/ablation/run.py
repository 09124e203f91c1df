"""Which feature sets earn their place on rivera_tank: `python training/ablation/run.py`. Writes results.json and README.md.

Each set is tried alone and left out of all of them; the error is that of leave-recordings-out.
"""

import time
import tomllib
from pathlib import Path

from nnhydro.evaluation.benchmark import benchmark
from nnhydro.files import write_json, write_text
from nnhydro.identification.config import TrainingConfig
from nnhydro.identification.identify import versions
from nnhydro.recordings.campaign import open_campaign

HERE = Path(__file__).parent
PAGE = """# Which feature sets earn their place

`python training/ablation/run.py` ({minutes} minutes on two cores): error of the network on held-out recordings of {campaign}, {folds}
folds, with all feature sets {all:.2f} %. A set earns its place where the error rises without it.

| feature set | alone | all but it | rises by |
| --- | --- | --- | --- |
{rows}
"""


def error_of(campaign, config, names):
    """Return the pooled held-out error with the feature sets `names` alone."""
    chosen = TrainingConfig(features=names, members=config["members"], epochs=config["epochs"], seed=config["seed"])
    result = benchmark(campaign, [config["model"]], config["folds"], config["seed"], chosen)
    return result.standings[config["model"]].pooled.error


def main():
    """Run the study, print the table, write results.json and README.md."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    campaign = open_campaign(Path(config["campaign"]))
    sets, start = TrainingConfig().features, time.perf_counter()
    every = error_of(campaign, config, sets)
    alone, without = {}, {}
    for name in sets:
        if name != "arm":  # constants of one arm tell nothing alone
            alone[name] = error_of(campaign, config, (name,))
        without[name] = error_of(campaign, config, tuple(other for other in sets if other != name))
        told = f"alone {100 * alone.get(name, 1.0):.2f} %, all but it {100 * without[name]:.2f} %"
        print(f"{name}: {told} (all: {100 * every:.2f} %)", flush=True)
    seconds = time.perf_counter() - start
    rows = "\n".join(f"| {name} | {f'{100 * alone[name]:.1f} %' if name in alone else ''} | {100 * without[name]:.2f} % | "
                     f"{100 * (without[name] / every - 1):+.0f} % |" for name in sorted(sets, key=lambda name: -without[name]))
    write_text(HERE / "README.md", PAGE.format(minutes=round(seconds / 60), campaign=config["campaign"], folds=config["folds"],
                                               all=100 * every, rows=rows))
    write_json(HERE / "results.json", {"all": every, "alone": alone, "without": without, "seconds": round(seconds), "config": config,
                                       "versions": versions() | {"campaign_sha256": campaign.sha256()}})


if __name__ == "__main__":
    main()
