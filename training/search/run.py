"""Which choices of the training are best on rivera_tank: `python training/search/run.py [key=value ...]`; needs nnhydro[search].

The search sees four of five folds; its winner and the defaults are then judged on the fifth. Writes results.json. `jobs=3` trains the inner
folds of a trial at the same time.
"""

import sys
import time
import tomllib
from pathlib import Path

from nnhydro.evaluation.metrics import Misfit
from nnhydro.evaluation.model_errors import misfit_of
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.hyperparameters import search
from nnhydro.fitting.identify import versions
from nnhydro.recordings.campaign import open_campaign
from nnhydro.runtime.files import write_json
from nnhydro.runtime.workers import Workers

HERE = Path(__file__).parent


def error(model, chosen):
    """Return McLain & Rock's pooled error of `model` on the units `chosen`."""
    return Misfit.total(misfit for unit in chosen if (misfit := misfit_of(model, unit)) is not None).error


def main():
    """Search, print the trials and write results.json."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    config |= {key: int(value) if value.isdigit() else value for key, value in (word.split("=", 1) for word in sys.argv[1:])}
    campaign = open_campaign(Path(config["campaign"]))
    start = time.perf_counter()
    found = search(campaign, TrainingConfig.model_validate(config["start"]), config["ranges"], config["trials"], error,
                   progress=lambda n, e: print(f"trial {n}: {100 * e:.2f} %", flush=True), workers=Workers(config.get("jobs", 1)))
    print(f"held out of the search: {100 * found.held_out_error:.2f} %, with the starting choices {100 * found.default_error:.2f} %")
    write_json(HERE / "results.json", {**found.document(), "seconds": round(time.perf_counter() - start), "config_file": config,
                                       "versions": versions() | {"campaign_sha256": campaign.sha256()}})


if __name__ == "__main__":
    main()
