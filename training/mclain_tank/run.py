"""A hybrid where the physics is right already: `python training/mclain_tank/run.py`. Writes results.json and README.md.

datasets/mclain_tank follows the state-dependent model of McLain & Rock; what `state` leaves of it is little more than noise, so that a
hybrid on it can gain next to nothing and must lose nothing.
"""

import time
import tomllib
from pathlib import Path

from nnhydro.evaluation.benchmark import benchmark
from nnhydro.evaluation.benchmark_result import BenchmarkResult
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import versions
from nnhydro.recordings.campaign import open_campaign
from nnhydro.runtime.files import write_json, write_text

HERE = Path(__file__).parent
PAGE = """# A hybrid on the state-dependent model

**Measured with nnhydro {version}; figures of another version may differ.**

`python training/mclain_tank/run.py` ({minutes} minutes on one core): sum |measured - model| / sum |measured| on held-out recordings of
datasets/mclain_tank, in %. The hybrid stands on `state`. Figures of earlier versions stand in earlier.csv alone.
{tables}"""


def table(result: BenchmarkResult) -> str:
    """Return the pooled errors of one protocol, and those of each of its folds."""
    folds = result.split.folds
    names = " | ".join(fold.name for fold in folds)
    head = ["", f"## {result.protocol}", "", f"| model | pooled | {names} |", "| --- " * (len(folds) + 2) + "|"]
    rows = [(name, [standing.pooled.error, *(result.fold_errors(k)[name] for k in range(len(folds)))])
            for name, standing in result.standings.items()]
    return "\n".join([*head, *(f"| {name} | {' | '.join(f'{100 * e:.2f}' for e in errors)} |" for name, errors in rows), ""])


def main() -> None:
    """Run the protocols, print the tables, write results.json and README.md."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    campaign, start = open_campaign(Path(config["campaign"])), time.perf_counter()
    choices = TrainingConfig(baseline=config["baseline"])
    results = {}
    for protocol in config["protocols"]:
        results[protocol] = benchmark(campaign, config["models"], config["folds"], config["seed"], choices, protocol=protocol)
        print(table(results[protocol]), flush=True)
    seconds = time.perf_counter() - start
    version, minutes = versions()["nnhydro"].partition("+")[0], max(1, round(seconds / 60))
    write_text(HERE / "README.md", PAGE.format(version=version, minutes=minutes, tables="\n".join(map(table, results.values()))))
    write_json(HERE / "results.json", {protocol: result.document() for protocol, result in results.items()} | {"seconds": round(seconds)})


if __name__ == "__main__":
    main()
