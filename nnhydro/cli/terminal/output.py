"""What commands print: rich tables for people, one JSON document for programs (`--json`), nothing else on standard output.

Every command ends alike: a verdict in one sentence, what was written, the next command to try. `--quiet` leaves the verdict alone.
"""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from nnhydro.sheet import Sheet

if TYPE_CHECKING:
    from nnhydro.evaluation.benchmark_result import BenchmarkResult
    from nnhydro.recordings.campaign import Campaign

# work that can be shared out: runtime/workers.py, docs/cluster.md
JOBS = typer.Option(1, "--jobs", help="Number of processes on this machine; -1: one per core.")
BACKEND = typer.Option("processes", "--backend", help="processes, or dask: the workers of the cluster at --scheduler.")
SCHEDULER = typer.Option("", "--scheduler", help="Address of a dask scheduler, such as tcp://head:8786.")
CUTOFF = typer.Option(None, "--cutoff", help="Low-pass cut-off in Hz; chosen from the data where not given.")
MAP = typer.Option(None, "--map", help="YAML file with foreign columns and their units; by default columns.yaml in the campaign.")
_quiet = False  # of the command that runs; QUIET sets it anew for each


def _hush(value: bool) -> bool:
    global _quiet
    _quiet = value
    return value


def quiet() -> bool:
    """Whether the command that runs was asked for its verdict alone."""
    return _quiet


QUIET = typer.Option(False, "--quiet", "-q", help="Print only the verdict: no tables, no progress.", callback=_hush)
JSON = typer.Option(False, "--json", help="Print the result as JSON, for programs.")


def say(text: str = "") -> None:
    """Print a line for people."""
    if not _quiet:
        typer.echo(text)


def note(text: str) -> None:
    """Print a line of progress to standard error, where it does not mix with results."""
    if not _quiet:
        typer.echo(text, err=True)


def conclude(verdict: str, written: Sequence[Path] = (), following: str = "") -> None:
    """Print how a command ends: the verdict (bold on a terminal, also with --quiet), what was written, the next command."""
    typer.echo(typer.style(verdict, bold=True))
    for path in written:
        say(f"  {path}")
    if following:
        say(f"Next: {following}")


def shell_words(path: Path | str, column_map: Path | None = None) -> str:
    """Return `path` as it can be shell_words in a shell, quoted where it must be, and the --map with which it was read."""
    return shlex.quote(str(path)) + _map(column_map)


def _map(column_map: Path | None) -> str:
    return "" if column_map is None else f" --map {shlex.quote(str(column_map))}"


def note_folders_without_arm(root: Path) -> None:
    """Say on standard error which folders beside the campaigns inside `root` are passed over."""
    from nnhydro.recordings.campaign import folders_without_arm

    names = folders_without_arm(root)
    if names:
        more = f" and {len(names) - 5} more" if len(names) > 5 else ""
        note(f"passed over, without arm.yaml: {', '.join(names[:5])}{more}")


def warn_of_errors(campaign: "Campaign") -> bool:
    """Say on standard error what makes the recordings unusable, as nnhydro check would; return whether anything does."""
    from nnhydro.recordings.survey import errors_of

    found = errors_of(campaign)
    if found:
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        note(f"warning: nnhydro check calls this campaign not usable: {found[0]}{more}")
    return bool(found)


def nothing_to_hold_out(recordings: int, tables: int) -> bool:
    """Return whether a campaign is a single recording; of a steady table, rows can be held out."""
    return recordings < 2 and tables == 0


def use_of(model: Path, campaign: Path, column_map: Path | None = None) -> str:
    """Return the command that uses a new model: on the campaign's unseen motions where it has any, else a look at its gains."""
    from nnhydro.recordings.readers.files import is_readable
    from nnhydro.runtime.stamp import is_system_file

    unseen = campaign / "unseen"
    motions = [path for path in sorted(unseen.iterdir()) if not is_system_file(path.name) and is_readable(path)] if unseen.is_dir() else []
    if motions:
        return f"nnhydro predict {shell_words(model)} {shell_words(unseen)}/*{motions[0].suffix}{_map(column_map)} --out torques"
    return f"nnhydro gains {shell_words(model)}   (effective damping and inertia)"


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[bool] = (True,)) -> None:
    """Print a table: columns of `words` left, the others right; as wide as its content when the output is piped."""
    if _quiet:
        return
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)  # markup would swallow units such as [s]
    if not console.is_terminal:
        console = Console(highlight=False, markup=False, width=200)
    made = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, title_style="bold")
    for number, name in enumerate(columns):
        made.add_column(name, justify="left" if number < len(words) and words[number] else "right")
    for row in rows:
        made.add_row(*row)
    console.print(made)


def show(sheet: Sheet) -> None:
    """Print a sheet."""
    table(sheet.title, sheet.headings(), sheet.rows(), [column.words for column in sheet.columns])


def without_bulk(record: dict[str, Any]) -> dict[str, Any]:
    """Return how a model came about without what fills pages: the points of its domain."""
    return {key: value for key, value in record.items() if key != "domain"}


def emit(document: Any) -> None:
    """Print `document` as JSON."""
    from nnhydro.runtime.files import json_text

    typer.echo(json_text(document), nl=False)


def print_benchmark(result: "BenchmarkResult", written: Sequence[Path], following: str) -> None:
    """Print the tables, the verdict in a sentence, what was `written` and the next command."""
    from nnhydro.report.benchmark.tables import benchmark_sheets

    for sheet in benchmark_sheets(result):
        show(sheet)
    conclude(result.verdict(), written, following)
