"""What `nnhydro benchmark` prints."""

from collections.abc import Sequence
from pathlib import Path

from nnhydro.cli.terminal.output import conclude, show
from nnhydro.evaluation.benchmark import BenchmarkResult
from nnhydro.report.benchmark.tables import benchmark_sheets


def print_benchmark(result: BenchmarkResult, written: Sequence[Path], following: str) -> None:
    """Print the tables, the verdict in a sentence, what was `written` and the next command."""
    for sheet in benchmark_sheets(result):
        show(sheet)
    conclude(result.verdict(), written, following)
