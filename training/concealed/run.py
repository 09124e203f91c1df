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


def defaults() -> dict:
    """Return config.toml."""
    return tomllib.loads((HERE / "config.toml").read_text())


def configured(overrides: list[str]) -> dict:
    """Return config.toml with the overrides of the command line."""
    config = defaults()
    for key, _, value in (item.partition("=") for item in overrides):
        if key not in config:
            sys.exit(f"{key}: not in {HERE / 'config.toml'}: choose one of {', '.join(config)}")
        config[key] = type(config[key])(value)
    return config


def suite_of(config: dict) -> Path:
    """Return the suite that `config` describes, made where it is not there yet."""
    from nnhydro.blind_tests.conceal import MARKER, conceal
    from nnhydro.blind_tests.truth.campaign import Wish

    given = {key: value for key, value in config.items() if key not in ("jobs", "without") and (key, value) != ("acts", "always")}
    place = RUNS / "_".join(f"{key}-{value}"[:60].replace(",", "+") for key, value in given.items())
    if not (place / MARKER).is_file():
        wishes = [Wish(name, config["strength"], config["links"] or None, config["effects"], config["size"], config["acts"])
                  for name in config["effect"].split(",") for _ in range(config["count"])]
        conceal(place, wishes, config["seed"], progress=print)
    return place


def left_out(suite: Path, what: str) -> dict[str, tuple[str, ...]]:
    """Return the effects that are taken out of the catalogue a campaign: none, or (`family`) the whole family of what is hidden there."""
    from nnhydro.blind_tests.reveal import read_suite
    from nnhydro.blind_tests.seal import KEY_FILE, open_sealed, read_key
    from nnhydro.effects.catalogue import catalogue

    public = read_suite(suite)
    if what != "family":
        return dict.fromkeys(public, ())
    key, found = read_key(suite / KEY_FILE), {}
    for name, campaign in public.items():
        answer = open_sealed(suite / "answers" / f"{name}.sealed", key, campaign["commitment"])
        families = {entry["family"] for entry in answer["effects"]}
        found[name] = tuple(cls.id for cls in catalogue().values() if cls.family in families)
    return found


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


def scored(suite: Path, workers, without: str = "") -> dict:
    """Return the score of a suite, its campaigns diagnosed where they are not yet; it ends where one cannot be diagnosed."""
    from nnhydro.blind_tests.reveal import read_suite, reveal
    from nnhydro.diagnosis.diagnose import DiagnosisOptions
    from nnhydro.report.diagnosis.batch import DiagnosisRequest, diagnose_all

    found, out = RUNS / f"{suite.name}_diagnoses{'_without_' + without if without else ''}", left_out(suite, without)
    todo = [DiagnosisRequest(suite / name, found / name, DiagnosisOptions(public["baseline"], without=tuple(out[name])))
            for name, public in read_suite(suite).items()
            if not (found / name / "diagnosis.json").is_file()]
    failed = []
    for told in diagnose_all(todo, workers) if todo else ():
        print(line(told), flush=True)
        failed += [line(told)] if told.document is None else []
    if failed:
        sys.exit(f"{len(failed)} of {len(todo)} campaigns of {suite} could not be diagnosed, no score without them: {'; '.join(failed)}")
    return reveal(suite, found)


def main() -> None:
    """Make the suite, diagnose it, print and store the score."""
    from nnhydro.cli.terminal.score import print_score
    from nnhydro.runtime.files import write_json
    from nnhydro.runtime.workers import Workers

    arguments = sys.argv[1:]
    given, backend, scheduler = (option(arguments, name) for name in ("suite", "backend", "scheduler"))
    config = configured(arguments)
    suite = Path(given) if given else suite_of(config)
    workers = Workers(1 if backend == "dask" else config["jobs"], backend or "processes", scheduler)
    score = scored(suite, workers, config["without"])
    print_score(score, str(suite))
    write_json(RUNS / f"{suite.name}_score.json", score)


if __name__ == "__main__":
    main()
