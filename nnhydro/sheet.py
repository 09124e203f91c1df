"""Results for people: numbers in words, sheets (titled tables for the terminal, a page or a data frame), and results that show both.

A p value that draws cannot tell from 0 is bounded; an error is never rounded to nothing.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, final

if TYPE_CHECKING:
    import pandas as pd

NOTHING = ""
Form = str | Callable[[Any], str]


def percent_interval(ends: tuple[float, float]) -> str:
    """Return an interval of shares as per cent."""
    return f"{100 * ends[0]:.1f} to {100 * ends[1]:.1f}"


def interval(ends: tuple[float, float]) -> str:
    """Return an interval, four digits."""
    return f"{ends[0]:.4g} to {ends[1]:.4g}"


@final
@dataclass(frozen=True, eq=False)
class Column:
    """One column: heading, raw values (None: nothing to say), how a value is written, and its name in a data frame.

    `form` is a format such as "{:.3g}" or a function; a value that is a pair becomes two columns of a frame, `key_low` and `key_high`.
    """

    heading: str
    values: Sequence[Any]
    form: Form = "{}"
    key: str = ""
    words: bool = False  # aligned left

    def cell(self, value: Any) -> str:
        """Return one value as text."""
        if value is None:
            return NOTHING
        return self.form(value) if callable(self.form) else self.form.format(value)

    def cells(self) -> list[str]:
        """Return all values as text."""
        return [self.cell(value) for value in self.values]

    def series(self) -> dict[str, list[Any]]:
        """Return the raw values by their names in a data frame."""
        name = self.key or self.heading
        if any(isinstance(value, tuple) for value in self.values):
            pairs = [value or (None, None) for value in self.values]
            return {f"{name}_low": [low for low, _ in pairs], f"{name}_high": [high for _, high in pairs]}
        return {name: list(self.values)}


@final
@dataclass(frozen=True, eq=False)
class Sheet:
    """A table of columns of equal length."""

    title: str
    columns: tuple[Column, ...]

    def __len__(self) -> int:
        return len(self.columns[0].values) if self.columns else 0

    def headings(self) -> list[str]:
        """Return the headings."""
        return [column.heading for column in self.columns]

    def rows(self) -> list[list[str]]:
        """Return the rows as text."""
        return [list(row) for row in zip(*(column.cells() for column in self.columns), strict=True)]

    def frame(self) -> "pd.DataFrame":
        """Return the raw values as a data frame."""
        import pandas as pd

        return pd.DataFrame({name: values for column in self.columns for name, values in column.series().items()})

    def text(self) -> str:
        """Return the table as plain text, columns aligned."""
        rows = [self.headings(), *self.rows()]
        widths = [max(len(row[k]) for row in rows) for k in range(len(self.columns))]
        lines = ["  ".join(cell.ljust(width) if column.words else cell.rjust(width)
                           for cell, width, column in zip(row, widths, self.columns, strict=True)).rstrip() for row in rows]
        return "\n".join(([self.title] if self.title else []) + [lines[0], "-" * (sum(widths) + 2 * len(widths) - 2), *lines[1:]])

    def html(self) -> str:
        """Return the table as HTML: caption, headings of columns, and of rows where the first column is words."""
        def cell(column: Column, text: str, first: bool) -> str:
            """Return the HTML of a cell; the first of a row of words heads it."""
            if first and column.words:
                return f'<th scope="row" class="words">{escape(text)}</th>'
            return f'<td{" class=words" if column.words else ""}>{escape(text)}</td>'

        head = "".join(f'<th scope="col"{" class=words" if column.words else ""}>{escape(column.heading)}</th>' for column in self.columns)
        body = "".join("<tr>" + "".join(cell(column, text, k == 0) for k, (column, text) in enumerate(zip(self.columns, row, strict=True)))
                       + "</tr>" for row in self.rows())
        caption = f"<caption>{escape(self.title)}</caption>" if self.title else ""
        return f'<div class="wide"><table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


STYLE = ".nnhydro table{border-collapse:collapse}.nnhydro td,.nnhydro th{padding:.1em .7em;text-align:right}" \
        ".nnhydro caption{text-align:left;font-weight:bold;padding:.4em .7em}.nnhydro .words{text-align:left}"


class ResultView(ABC):
    """A result that shows itself. `sheets()` are its tables, the first is its data frame; `verdict()` is one sentence."""

    @abstractmethod
    def verdict(self) -> str:
        """Return the result in one sentence."""

    @abstractmethod
    def sheets(self) -> tuple[Sheet, ...]:
        """Return the tables, the most telling first."""

    def to_frame(self) -> "pd.DataFrame":
        """Return the first table as a data frame of raw numbers: SI units, shares as fractions of 1."""
        return self.sheets()[0].frame()

    def __repr__(self) -> str:
        tables = [sheet.text() for sheet in self.sheets() if len(sheet)]
        return "\n\n".join([f"{type(self).__name__}: {self.verdict()}", *tables])

    def _repr_html_(self) -> str:
        """Return the result for notebooks."""
        tables = "".join(sheet.html() for sheet in self.sheets() if len(sheet))
        said = f"<p><b>{escape(type(self).__name__)}</b>: {escape(self.verdict())}</p>"
        return f"<div class='nnhydro'><style>{STYLE}</style>{said}{tables}</div>"


SMALLEST = 1e-3  # what 999 draws can tell


def p_text(p: float, draws: int | None = None) -> str:
    """Return "p = 0.034", or "p < 0.001" where `p` is below what `draws` (999 by default) can tell; never "p = 0.000".

    The bound of d draws is 1/(d + 1). Source: Davison & Hinkley (1997), Bootstrap Methods, section 4.2, from general knowledge.
    """
    least = SMALLEST if draws is None else 1 / (draws + 1)
    if not p > least:
        return f"p < {least:.1g}" if least < 1e-3 else f"p < {least:.3g}"
    return f"p = {p:.3f}" if p >= 5e-4 else f"p = {p:.1g}"


def percent(share: float) -> str:
    """Return "3.5 %", below 1 % with two digits that count: "0.57 %" and "0.55 %" are not both "0.6 %"."""
    return f"{100 * share:#.2g} %" if 1e-4 <= share < 0.01 else f"{100 * share:.1f} %"
