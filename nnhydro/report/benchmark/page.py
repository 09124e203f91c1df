"""The page of a benchmark: the verdict first, then all models, recording by recording, the curves, where the residual lies, the doubt."""

from pathlib import Path
from typing import Any

from nnhydro.conventions import with_units
from nnhydro.evaluation.benchmark_result import BenchmarkResult
from nnhydro.evaluation.protocols.protocol import DEFAULT, protocol_called
from nnhydro.models.baselines import BASELINES
from nnhydro.report.benchmark.figures import (
    benchmark_figures,
    coverage_shares,
    error_figure,
    learning_curves,
    reliability_figure,
    shown_models,
)
from nnhydro.report.benchmark.tables import coverage_sheet, folds_sheet, models_sheet
from nnhydro.report.figure_file import page_figure
from nnhydro.report.widgets.history import histories
from nnhydro.report.widgets.render import render
from nnhydro.report.widgets.residual_map import largest, residual_maps
from nnhydro.report.widgets.trace import MOST, benchmark_traces, spread, table_of, with_whole_tables
from nnhydro.runtime.files import json_text, whole_folder

RELIABILITY = "Share of held-out torques inside the intervals, against the share that the intervals promise"
DARKEST = 1.0  # error at which the table's colour ends, where errors are that large


def _by_recording(result: BenchmarkResult, models: dict[str, Any]) -> list[tuple[str, str, list[tuple[str, float | None, float]]]]:
    """Every unit and its picture, the worst for the best model first, with each model's error and its place on the colour scale."""
    names = result.ranking()
    table = {name: models[name]["by_recording"] for name in names}
    top = min(max((e for row in table.values() for e in row.values()), default=1.0), DARKEST) or 1.0
    units = sorted(table[names[0]], key=table[names[0]].__getitem__, reverse=True)

    def cell(name: str, unit: str) -> tuple[str, float | None, float]:
        error = table[name].get(unit)
        return name, error, min((error or 0.0) / top, 1.0)

    return [(unit, table_of(unit), [cell(name, unit) for name in names]) for unit in units]


def _models_mapped(result: BenchmarkResult) -> list[str]:
    """The models whose residual is mapped: the best, and the best physics where that is another."""
    ranking = result.ranking()
    return list(dict.fromkeys([ranking[0], *[name for name in ranking if name in BASELINES][:1]]))


def benchmark_page(result: BenchmarkResult) -> str:
    """Return the page as HTML text."""
    document, names = result.document(), result.ranking()
    models, styles = document["models"], {name: number % 9 for number, name in enumerate(names)}
    held_out = [unit for unit, _, _ in _by_recording(result, models)]
    traces = benchmark_traces(result, spread(held_out, MOST))
    maps = residual_maps(traces, _models_mapped(result))
    drawn = histories(with_whole_tables(traces), styles, shown_models(result))
    covered = coverage_shares(result)
    protocol = f"{len(result.folds)} folds, every recording held out once." if result.protocol == DEFAULT else \
        f"Protocol {result.protocol}: {protocol_called(result.protocol).meaning}."
    page = render(
        "benchmark.html", arm=result.campaign.arm.name, verdict=result.verdict(), d=document, styles=styles, protocol=protocol,
        errors=page_figure(error_figure(result), "Error of every model on held-out recordings, with 95 % interval"),
        models=models_sheet(result, document), folds=None if result.protocol == DEFAULT else folds_sheet(result),
        curve=page_figure(learning_curves(result), "Error against the number of recordings fitted") if result.split.curve else None,
        by_recording=_by_recording(result, models), drawn={drawing.recording for drawing in drawn}, histories=drawn,
        shown_first=shown_models(result), maps=maps, heat=largest(maps),
        shown=len({trace.recording for trace in traces if not trace.segment.steady}), of=sum(not unit.steady for unit in result.units),
        reliability=page_figure(reliability_figure(covered), RELIABILITY) if covered else None, coverage=coverage_sheet(result, document))
    return with_units(page, result.campaign.arm.sliding)


RESULT, PAGE = "benchmark.json", "report.html"
SHOWN = (".json", ".html", ".png")  # kinds of files that are worth a line; SVG and CSV lie beside each PNG


def write_benchmark(result: BenchmarkResult, out: Path) -> list[Path]:
    """Write the benchmark to the folder `out` and return the paths of its files, figures last."""
    with whole_folder(out, RESULT) as work:
        (work / RESULT).write_text(json_text(result.document()), encoding="utf-8")
        (work / PAGE).write_text(benchmark_page(result), encoding="utf-8")
        names = [RESULT, PAGE, *(path.name for path in benchmark_figures(result, work))]
    return [out / name for name in names]
