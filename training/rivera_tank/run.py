"""Every model under every protocol: `python training/rivera_tank/run.py [PROTOCOL ...]`. Writes results.json, README.md and earlier.csv.

leave-arm-out needs several arms: three are simulated from arms.yaml, the others use datasets/rivera_tank. A protocol named on the command
line is run again, the others are kept from results.json; `page` alone writes the page anew.
"""

import json
import sys
import tempfile
import time
import tomllib
from pathlib import Path

import yaml
from table import earlier, page

import nnhydro
from nnhydro.cli.terminal.output import print_benchmark
from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.recordings.campaign import open_campaign, open_campaigns
from nnhydro.runtime.files import write_json, write_text
from nnhydro.simulation.campaign_writer import write_campaign
from nnhydro.simulation.recipe.recipe import read_recipe

HERE = Path(__file__).parent
ARMS = "leave-arm-out"


def stretched(recipe: dict, factor: float, seed: int) -> dict:
    """Return the recipe with every link longer by `factor` at the same diameter, of the same material."""
    powers = {"length_m": 1, "com_m": 1, "mass_kg": 1, "inertia_kg_m2": 3}
    links = [{key: value * factor ** powers.get(key, 0) for key, value in link.items()} for link in recipe["arm"]["links"]]
    name = f"{recipe['name']}_{factor:g}".replace(".", "_")
    return recipe | {"name": name, "seed": seed, "arm": recipe["arm"] | {"links": links, "name": name}}


def simulated_arms(config: dict, folder: Path) -> tuple:
    """Write one campaign an arm to `folder` and return them."""
    recipe = yaml.safe_load(Path(config["arms"]).read_text())
    for number, factor in enumerate(config["slenderness"]):
        made = stretched(recipe, factor, number + 1)
        (folder / f"{made['name']}.yaml").write_text(yaml.safe_dump(made))
        write_campaign(read_recipe(folder / f"{made['name']}.yaml"), folder / made["name"])
    return open_campaigns(folder)


def main() -> None:
    """Run the protocols, print their tables, write results.json and README.md after each."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    results = json.loads((HERE / "results.json").read_text()) if (HERE / "results.json").exists() else {}
    def write() -> None:
        write_text(HERE / "README.md", page(results, nnhydro.__version__))
        write_text(HERE / "earlier.csv", earlier(results, nnhydro.__version__))

    write()
    for protocol in [word for word in sys.argv[1:] if word != "page"] or ([] if sys.argv[1:] else [*config["protocols"], ARMS]):
        start = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            arms = protocol == ARMS
            campaign = simulated_arms(config, Path(folder)) if arms else open_campaign(Path(config["campaign"]))
            models = config["arm_models" if arms else "models"]
            result = BenchmarkOptions(models, config["folds"], config["seed"], protocol=protocol).benchmark(campaign)
        results[protocol] = result.document() | {"seconds": round(time.perf_counter() - start)}
        write_json(HERE / "results.json", results)
        write()
        print_benchmark(result, [HERE / "README.md", HERE / "results.json"], "nnhydro benchmark CAMPAIGN --out DIR")


if __name__ == "__main__":
    main()
