"""What a benchmark leaves on disk: benchmark.json and the plots, whole or not at all."""

from pathlib import Path

from nnhydro.evaluation.benchmark import Benchmark
from nnhydro.files import json_text, whole_folder
from nnhydro.report.figures import benchmark_figures

RESULT = "benchmark.json"


def write_benchmark(result: Benchmark, out: Path) -> list[Path]:
    """Write the benchmark to the folder `out` and return the paths of its files, plots last."""
    with whole_folder(out, RESULT) as work:
        (work / RESULT).write_text(json_text(result.document()), encoding="utf-8")
        names = [RESULT, *(path.name for path in benchmark_figures(result, work))]
    return [out / name for name in names]
