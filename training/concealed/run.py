"""Diagnose a fresh suite of concealed campaigns and print the score: `python training/concealed/run.py [KEY=VALUE ...] [--suite DIR]`.

KEY=VALUE overrides config.toml, e.g. `count=40 strength=weak seed=7`. With `--suite DIR` an existing suite is diagnosed, e.g.
datasets/concealed. Everything goes to runs/; a campaign that has been diagnosed is not diagnosed again.
"""

import sys
import tomllib
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
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


def diagnose_one(campaign: Path, out: Path, baseline: str) -> str:
    """Diagnose one campaign and return a line about it; a user's error is a line, too."""
    from nnhydro.diagnosis.engine import diagnose
    from nnhydro.errors import NnhydroError
    from nnhydro.recordings.campaign import open_campaign
    from nnhydro.report.diagnosis_folder import write_diagnosis

    opened = open_campaign(campaign)
    try:
        found = diagnose(opened, baseline)
        write_diagnosis(found, opened, out)
    except NnhydroError as error:
        return f"{campaign.name}: {error}"
    return f"{campaign.name}: {', '.join(f['effect'] for f in found.document()['findings']) or 'nothing'}"


def main() -> None:
    """Make the suite, diagnose it, print and store the score."""
    if find_spec("nnhydro.diagnosis") is None or find_spec("nnhydro.diagnosis.engine") is None:
        sys.exit("nnhydro.diagnosis.engine is not there: nothing to score")
    from nnhydro.files import write_json
    from nnhydro.report.score_table import print_score
    from nnhydro.simulation.reveal import read_suite, reveal

    arguments = sys.argv[1:]
    given = Path(arguments.pop(arguments.index("--suite") + 1)) if "--suite" in arguments else None
    config = configured([a for a in arguments if a != "--suite"])
    suite = given or suite_of(config)
    found = RUNS / f"{suite.name}_diagnoses"
    todo = [(suite / name, found / name, public["baseline"]) for name, public in read_suite(suite).items()
            if not (found / name / "diagnosis.json").is_file()]
    with ProcessPoolExecutor(config["jobs"]) as pool:
        for line in pool.map(diagnose_one, *zip(*todo, strict=True)) if todo else ():
            print(line, flush=True)
    score = reveal(suite, found)
    print_score(score, str(suite))
    write_json(RUNS / f"{suite.name}_score.json", score)


if __name__ == "__main__":
    main()
