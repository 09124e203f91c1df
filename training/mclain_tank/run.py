"""A hybrid where the physics is right already: `python training/mclain_tank/run.py`. Writes results.json and README.md.

datasets/mclain_tank follows the state-dependent model of McLain & Rock; what `state` leaves of it is little more than noise, so that a
hybrid on it can gain next to nothing and must lose nothing.
"""

import time
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import versions
from nnhydro.recordings.campaign import open_campaign
from nnhydro.runtime.files import write_json, write_text

HERE = Path(__file__).parent
PAGE = """# A hybrid on the state-dependent model

**Measured with nnhydro {version}; figures of another version may differ.**

`python training/mclain_tank/run.py` (about {minutes} min on one core): sum |measured - model| / sum |measured| on held-out recordings of
datasets/mclain_tank, in %. The hybrid stands on `state`. earlier.csv has the figures of earlier versions.

{table}"""


def table(documents: Mapping[str, dict[str, Any]]) -> str:
    """Return one row for each protocol and for each of its folds, one column for each model: errors in %."""
    models = list(next(iter(documents.values()))["models"])
    lines = [f"| protocol | held out | {' | '.join(models)} |", "| --- " * (len(models) + 2) + "|"]
    for protocol, document in documents.items():
        rows = {"all": {name: entry["error"] for name, entry in document["models"].items()}}
        rows |= {fold["name"]: fold["errors"] for fold in document["folds"]}
        lines += [f"| {protocol} | {name} | {' | '.join(f'{100 * errors[m]:.2f}' for m in models)} |" for name, errors in rows.items()]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run the protocols, print the tables, write results.json and README.md."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    campaign, start = open_campaign(Path(config["campaign"])), time.perf_counter()
    choices = TrainingConfig(baseline=config["baseline"])
    results = {}
    for protocol in config["protocols"]:
        options = BenchmarkOptions(config["models"], config["folds"], config["seed"], choices, protocol)
        results[protocol] = options.benchmark(campaign)
        print(table({protocol: results[protocol].document()}), flush=True)
    seconds = time.perf_counter() - start
    version, minutes = versions()["nnhydro"].partition("+")[0], max(1, round(seconds / 60))
    documents = {protocol: result.document() for protocol, result in results.items()}
    write_text(HERE / "README.md", PAGE.format(version=version, minutes=minutes, table=table(documents)))
    write_json(HERE / "results.json", documents | {"seconds": round(seconds)})


if __name__ == "__main__":
    main()
