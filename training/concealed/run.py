"""Diagnose a fresh suite of concealed campaigns and print the score: `python training/concealed/run.py [KEY=VALUE ...] [--suite DIR]`.

KEY=VALUE overrides config.toml, e.g. `count=40 strength=weak seed=7`. With `--suite DIR` an existing suite is diagnosed, e.g.
datasets/concealed. Everything goes to runs/; a campaign that has been diagnosed is not diagnosed again: a run that was ended goes on.
`--backend dask --scheduler ADDRESS` diagnoses on a cluster (docs/cluster.md) instead of in `jobs` processes here.
"""

import sys
import tomllib
from pathlib import Path

HERE = Path(__file__).parent
RUNS = HERE / "runs"


def configured(overrides: list[str]) -> dict:
    """Return config.toml with the overrides of the command line."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    for key, _, value in (item.partition("=") for item in overrides):
        if key not in config:
            sys.exit(f"{key}: not in {HERE / 'config.toml'}: choose one of {', '.join(config)}")
        config[key] = type(config[key])(value)
    return config


def suite_of(config: dict) -> Path:
    """Return the suite that `config` describes, made where it is not there yet."""
    from nnhydro.simulation.conceal import MARKER, conceal
    from nnhydro.simulation.truth.campaign import Wish

    place = RUNS / "_".join(f"{key}-{value}"[:60].replace(",", "+") for key, value in config.items() if key != "jobs")
    if not (place / MARKER).is_file():
        wishes = [Wish(name, config["strength"], config["links"] or None, config["effects"], config["size"])
                  for name in config["effect"].split(",") for _ in range(config["count"])]
        conceal(place, wishes, config["seed"], progress=print)
    return place


def option(arguments: list[str], name: str) -> str:
    """Take `--name VALUE` out of the command line and return the value, empty where it is not given."""
    if f"--{name}" not in arguments:
        return ""
    place = arguments.index(f"--{name}")
    value = arguments[place + 1]
    del arguments[place:place + 2]
    return value


def line(told) -> str:
    """Return what became of one campaign."""
    named = "nothing" if told.document is None else ", ".join(f["effect"] for f in told.document["findings"]) or "nothing"
    return f"{told.asked.campaign.name}: {named if told.document is not None else told.verdict}"


def main() -> None:
    """Make the suite, diagnose it, print and store the score."""
    from nnhydro.files import write_json
    from nnhydro.parallel import Workers
    from nnhydro.report.diagnosis_batch import Asked, diagnose_all
    from nnhydro.report.score_table import print_score
    from nnhydro.simulation.reveal import read_suite, reveal

    arguments = sys.argv[1:]
    given, backend, scheduler = (option(arguments, name) for name in ("suite", "backend", "scheduler"))
    config = configured(arguments)
    suite = Path(given) if given else suite_of(config)
    found = RUNS / f"{suite.name}_diagnoses"
    todo = [Asked(suite / name, found / name, public["baseline"]) for name, public in read_suite(suite).items()
            if not (found / name / "diagnosis.json").is_file()]
    workers = Workers(1 if backend == "dask" else config["jobs"], backend or "processes", scheduler)
    for told in diagnose_all(todo, workers) if todo else ():
        print(line(told), flush=True)
    score = reveal(suite, found)
    print_score(score, str(suite))
    write_json(RUNS / f"{suite.name}_score.json", score)


if __name__ == "__main__":
    main()
