"""The benchmark as sheets (all models, recording by recording, fold by fold, what each knows of its own error)."""

from functools import partial
from typing import Any

from nnhydro.errors import count_text
from nnhydro.evaluation.benchmark_result import BenchmarkResult
from nnhydro.evaluation.protocols.protocol import DEFAULT, protocol_called
from nnhydro.sheet import Column, Sheet, percent, percent_interval

PERFECT = "(a perfect model)"


def _title(result: BenchmarkResult) -> str:
    """What was held out, and how, in one line."""
    steady = sum(unit.steady for unit in result.units)
    counts = count_text(len(result.units) - steady, "recording")
    counts += f" and {sum(len(t) for campaign in result.campaigns for t in campaign.steady)} steady runs" if steady else ""
    if result.protocol == DEFAULT:
        return f"Held-out torque error: {counts}, each held out once in {len(result.folds)} folds"
    return f"Held-out torque error: {counts}, {protocol_called(result.protocol).meaning}"


def models_sheet(result: BenchmarkResult, document: dict[str, Any], perfect: bool = True) -> Sheet:
    """Return all models on held-out recordings, best first, and with `perfect` the noise floor as a last row."""
    names, models = result.ranking(), document["models"]
    floor = [None] if perfect and result.noise_floor is not None else []
    entries = [models[name] for name in names]
    columns = [Column("model", [*names, *([PERFECT] if floor else [])], words=True),
               Column("error", [*(m["error"] for m in entries), *([result.noise_floor] if floor else [])], percent),
               Column("95 % interval", [*(tuple(m["error_ci95"]) for m in entries), *floor], percent_interval, "error_ci95")]
    for joint in range(result.campaign.arm.n_links):
        columns.append(Column(f"NRMSE {joint + 1}", [*(m["nrmse"][joint] for m in entries), *floor], "{:.3f}", f"nrmse{joint + 1}"))
    for joint in range(result.campaign.arm.n_links):
        columns.append(Column(f"VAF {joint + 1}", [*(m["vaf"][joint] for m in entries), *floor], percent, f"vaf{joint + 1}"))
    return Sheet(_title(result), (*columns, Column("fit [s]", [*(m["fit_s"] for m in entries), *floor], "{:.1f}", "fit_s")))


def recordings_sheet(result: BenchmarkResult, document: dict[str, Any]) -> Sheet:
    """Return every model's error on every unit, worst for the best model first."""
    names, models = result.ranking(), document["models"]
    errors = {name: models[name]["by_recording"] for name in names}
    units = sorted(errors[names[0]], key=errors[names[0]].__getitem__, reverse=True)
    return Sheet("Error of every model on every recording, held out of its fit",
                 (Column("recording", units, words=True), *(Column(name, [errors[name].get(u) for u in units], percent) for name in names)))


def folds_sheet(result: BenchmarkResult) -> Sheet:
    """Return every model's error in every fold."""
    folds = result.split.folds
    errors = [result.fold_errors(k) for k in range(len(folds))]
    heading = "Error against the number of recordings fitted" if result.split.curve else "Error by what is held out"
    names = result.ranking()
    return Sheet(heading, (Column("model", names, words=True),
                           *(Column(fold.name, [e.get(name) for name in names], percent) for fold, e in zip(folds, errors, strict=True))))


def coverage_sheet(result: BenchmarkResult, document: dict[str, Any]) -> Sheet | None:
    """Return how often the intervals of models that know their uncertainty hold the measured torque; None where none knows."""
    known = [(name, document["models"][name]["coverage"]) for name in result.ranking() if "coverage" in document["models"][name]]
    if not known:
        return None
    whole = partial("{:.0%}".format)
    levels = [Column(f"of {level} %", [c["shares"][level] for _, c in known], whole, f"inside_{level}") for level in known[0][1]["shares"]]
    return Sheet("Intervals: share of held-out torques inside; std relative to the mean torque; width relative to fitted recordings",
                 (Column("model", [name for name, _ in known], words=True), *levels, Column("std", [c["width"] for _, c in known], percent),
                  Column("wider", [c.get("wider_than_fitted") for _, c in known], "{:.2f}")))


def benchmark_sheets(result: BenchmarkResult) -> tuple[Sheet, ...]:
    """Return what a reader sees first: all models, the folds where they differ in kind, and the intervals."""
    document = result.document()
    folds = () if result.protocol == DEFAULT else (folds_sheet(result),)
    covered = coverage_sheet(result, document)
    return (models_sheet(result, document), *folds, *(() if covered is None else (covered,)))
