"""The benchmark on the screen: a table, best model first, what each knows of its own error, fold by fold, and the verdict."""

from typing import Any

from nnhydro.evaluation.benchmark import Benchmark
from nnhydro.evaluation.protocols.protocol import DEFAULT, protocol_called
from nnhydro.report.screen import say, table


def _models(result: Benchmark, models: dict[str, Any]) -> None:
    """Print the table of all models on held-out recordings."""
    joints = result.campaign.arm.n_links
    rows = []
    for name in result.ranking():
        m = models[name]
        interval = " to ".join(f"{100 * x:.1f}" for x in m["error_ci95"])
        rows.append([name, f"{100 * m['error']:.1f} %", interval, *(f"{x:.3f}" for x in m["nrmse"]),
                     *(f"{100 * x:.1f} %" for x in m["vaf"]), f"{m['fit_s']:.1f}"])
    if result.noise_floor is not None:
        rows.append(["(a perfect model)", f"{100 * result.noise_floor:.1f} %", "", *[""] * (2 * joints + 1)])
    table(_title(result), ["model", "error", "95 % interval", *(f"NRMSE {j + 1}" for j in range(joints)),
                           *(f"VAF {j + 1}" for j in range(joints)), "fit [s]"], rows)


def _title(result: Benchmark) -> str:
    steady = sum(unit.steady for unit in result.units)
    held = f"{len(result.units) - steady} recordings"
    held += f" and {sum(len(t) for campaign in result.campaigns for t in campaign.steady)} steady runs" if steady else ""
    if result.protocol == DEFAULT:
        return f"Held-out torque error: {held}, each held out once in {len(result.folds)} folds"
    return f"Held-out torque error: {held}, {protocol_called(result.protocol).meaning}"


def _folds(result: Benchmark) -> None:
    """Print every model's error in every fold."""
    folds = result.split.folds
    errors = [result.fold_errors(k) for k in range(len(folds))]
    heading = "Error against the number of recordings fitted" if result.split.curve else "Error where is held out"
    rows = [[name, *(f"{100 * e[name]:.1f} %" if name in e else "" for e in errors)] for name in result.ranking()]
    table(heading, ["model", *(fold.name for fold in folds)], rows)


def _coverage(models: dict[str, Any], ranking: list[str]) -> None:
    """Print how often the intervals of models that know their uncertainty hold the measured torque."""
    known = [(name, models[name]["coverage"]) for name in ranking if "coverage" in models[name]]
    if known:
        rows = [[name, *(f"{100 * share:.0f} %" for share in c["shares"].values()), f"{100 * c['width']:.1f} %",
                 f"{c['wider_than_fitted']:.2f}" if "wider_than_fitted" in c else ""] for name, c in known]
        table("Intervals: share of held-out torques inside, mean std over mean torque, and how much wider than on fitted recordings",
              ["model", *(f"of {level} %" for level in known[0][1]["shares"]), "std", "wider"], rows)


def print_benchmark(result: Benchmark) -> None:
    """Print the table of all models on held-out recordings, coverage where models know it, and the verdict in a sentence."""
    models = result.document()["models"]
    _models(result, models)
    if result.protocol != DEFAULT:
        _folds(result)
    _coverage(models, result.ranking())
    say(result.verdict())
