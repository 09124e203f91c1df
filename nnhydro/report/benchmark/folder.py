"""What a benchmark leaves on disk: benchmark.json, the page report.html and the figures, whole or not at all."""

from pathlib import Path

from nnhydro.evaluation.benchmark import Benchmark
from nnhydro.report.benchmark.figures import benchmark_figures
from nnhydro.report.benchmark.page import benchmark_page
from nnhydro.runtime.files import json_text, whole_folder

RESULT, PAGE = "benchmark.json", "report.html"
SHOWN = (".json", ".html", ".png")  # kinds of files that are worth a line; SVG and CSV lie beside each PNG


def write_benchmark(result: Benchmark, out: Path) -> list[Path]:
    """Write the benchmark to the folder `out` and return the paths of its files, figures last."""
    with whole_folder(out, RESULT) as work:
        (work / RESULT).write_text(json_text(result.document()), encoding="utf-8")
        (work / PAGE).write_text(benchmark_page(result), encoding="utf-8")
        names = [RESULT, PAGE, *(path.name for path in benchmark_figures(result, work))]
    return [out / name for name in names]
