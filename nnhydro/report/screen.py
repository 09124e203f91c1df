"""What commands print: rich tables for people, one JSON document for programs (`--json`), nothing else on standard output."""

from collections.abc import Sequence
from typing import Any

import typer

from nnhydro.report.sheet import Sheet

MAP = typer.Option(None, "--map", help="YAML file: foreign columns and their units; columns.yaml in the campaign by default.")
JSON = typer.Option(False, "--json", help="Print the result as JSON, for programs.")


def say(text: str = "") -> None:
    """Print a line for people."""
    typer.echo(text)


def note(text: str) -> None:
    """Print a line of progress to standard error, where it does not mix with results."""
    typer.echo(text, err=True)


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[bool] = (True,)) -> None:
    """Print a table: columns of `words` left, the others right; as wide as its content when the output is piped."""
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


def emit(document: Any) -> None:
    """Print `document` as JSON."""
    from nnhydro.files import json_text

    typer.echo(json_text(document), nl=False)
