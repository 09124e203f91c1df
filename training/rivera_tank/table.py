"""The page of the study: one table of errors under every protocol, one of coverage, of the version at hand; a CSV of what others left."""

import csv
import io

FIRST = "leave-recordings-out"
HEAD = """# Every model under every protocol

`python training/rivera_tank/run.py` prints the tables; config.toml holds all choices, results.json all numbers. Error: McLain & Rock's
sum |measured - model| / sum |measured| on recordings held out of the fit, in %, on datasets/rivera_tank (synthetic). leave-arm-out has
three simulated arms of slenderness 0.7, 1 and 1.4 (arms.yaml). earlier.csv has the figures of other versions. Version 0.1.0 used the
very equation of the wake that this tank contains, so that its learned models are no evidence. Later versions learn the memory from the
recordings. [independent_tanks](../independent_tanks/README.md) has the errors of a later version on this tank.
"""
MEASURED = """
Measured with nnhydro {version} in {minutes} minutes; noise floor {floor:.2f} %.

"""


def _table(columns: list[str], rows: list[list[str]]) -> str:
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def _errors(results: dict) -> str:
    names = list(next(iter(results.values()))["models"])
    rows = []
    for name in names:
        told = [results[p]["models"].get(name) for p in results]
        rows.append([name, *(f"{100 * m['error']:.1f}" if m else "" for m in told)])
    return _table(["model", *results], rows)


def _folds(result: dict) -> str:
    folds = result["folds"]
    return _table(["model", *(fold["name"] for fold in folds)],
                  [[name, *(f"{100 * fold['errors'][name]:.1f}" for fold in folds)] for name in result["models"]])


def _coverage(results: dict) -> str:
    rows = []
    for protocol, result in results.items():
        for name, model in result["models"].items():
            if "coverage" in model:
                shares = [f"{100 * share:.0f}" for share in model["coverage"]["shares"].values()]
                rows.append([protocol, name, *shares, f"{100 * model['coverage']['width']:.1f}",
                             f"{model['coverage'].get('wider_than_fitted', float('nan')):.2f}"])
    return _table(["protocol", "model", "of 50 %", "of 80 %", "of 95 %", "std / torque, %", "wider than fitted"], rows)


def page(results: dict, version: str) -> str:
    """Return README.md for the results by protocol that `version` made, the default protocol first."""
    now = {key: one for key, one in results.items() if one["versions"]["nnhydro"] == version}
    now = dict(sorted(now.items(), key=lambda item: item[0] != FIRST))
    if not now:
        return HEAD
    minutes = sum(result["seconds"] for result in now.values()) / 60
    floor = next((100 * result["noise_floor"] for result in now.values() if result["noise_floor"] is not None), float("nan"))
    text = HEAD + MEASURED.format(version=version, minutes=round(minutes), floor=floor) + _errors(now)
    for protocol, result in now.items():
        if protocol != FIRST:
            text += f"\n## {protocol}: error where is held out, %\n\n{_folds(result)}"
    return text + f"\n## Coverage: share of held-out torques within the intervals, %\n\n{_coverage(now)}"


def earlier(results: dict, version: str) -> str:
    """Return earlier.csv: the error in % of every model in every fold under every protocol that another version than `version` measured."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["version", "protocol", "held_out", "model", "error_percent"])
    for protocol, result in sorted(results.items()):
        if (made := result["versions"]["nnhydro"]) != version:
            for model, entry in result["models"].items():
                rows.writerow([made, protocol, "all", model, f"{100 * entry['error']:.2f}"])
            for fold in result["folds"]:
                rows.writerows([made, protocol, fold["name"], model, f"{100 * error:.2f}"] for model, error in fold["errors"].items())
    return text.getvalue()
