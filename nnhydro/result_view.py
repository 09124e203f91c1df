"""What every result can do: say its verdict, print itself as text and in a notebook, turn into a data frame."""

from abc import ABC, abstractmethod
from html import escape
from typing import TYPE_CHECKING

from nnhydro.sheet import Sheet

if TYPE_CHECKING:
    import pandas as pd

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
