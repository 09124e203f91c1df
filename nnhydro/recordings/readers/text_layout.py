"""How a table of text is laid out: encoding, separator, decimal sign, a row of units. Nothing is assumed that can be seen."""

import csv
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

from nnhydro.errors import RecordingError
from nnhydro.recordings.readers.encoding import encoding_of

MAX_HEADER = 1_000_000  # characters: a longer first line is no header
PREAMBLE = 60  # lines that a logger may write above the header
LOOKED_AT = 20  # rows below the header that tell the decimal sign
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+(?:[eE][+-]?\d+)?\s*")
_NUMBER = re.compile(r"\s*[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?\s*|\s*[+-]?(?:nan|inf|infinity)\s*", re.IGNORECASE)
_UNIT = re.compile(r"[\[(<]?\s*([A-Za-z%\u00b0\u00b5][\w%\u00b0\u00b5\u00b2\u00b7*^/ .\-]{0,11})\s*[\])>]?")


@final
@dataclass(frozen=True)
class Layout:
    """What a text table looks like; `line` is the number of the header line, `first` that of the first row of numbers, counted from 1.

    `above` counts the lines of text above the header.
    """

    names: tuple[str, ...]
    delimiter: str
    line: int
    encoding: str
    decimal: str = "."
    units: tuple[str, ...] = ()
    above: int = 0

    @property
    def first(self) -> int:
        """Number of the first line of data."""
        return self.line + (2 if self.units else 1)

    @property
    def said(self) -> tuple[str, ...]:
        """What a reader should know of how the file was read."""
        remarks = [] if not self.above else [f"{self.above} line{'s' if self.above > 1 else ''} above the header passed over"]
        if self.encoding not in ("utf-8", "utf-8-sig"):
            remarks.append(f"text in {self.encoding}")
        if self.decimal == ",":
            remarks.append("decimal commas")
        if self.units:
            remarks.append("units from the row below the header")
        return tuple(remarks)


def _delimiter(line: str) -> str:
    """The separator that the header uses most, quoted parts aside; blanks where there is no other."""
    bare = re.sub(r'"[^"]*"', "", line)
    best = max((",", ";", "\t"), key=bare.count)
    return best if bare.count(best) or len(bare.split()) < 2 or '"' in line else r"\s+"


def cells(line: str, delimiter: str) -> list[str]:
    """Return the cells of one line."""
    if delimiter == r"\s+":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])]


def _units_in(row: list[str], count: int) -> tuple[str, ...]:
    """The units that a row below the header states, bare of brackets; none where it is no row of units."""
    written = [cell for cell in row if cell and cell != "-"]
    if len(row) != count or not written or any(_NUMBER.fullmatch(cell) or not _UNIT.fullmatch(cell) for cell in written):
        return ()
    bare = [_UNIT.fullmatch(cell) for cell in row]
    return tuple("" if match is None else match[1].strip() for match in bare)


def layout_of(path: Path) -> Layout:
    """Return the layout of the text table `path`: the header is the first line that is neither blank nor a comment.

    What a logger writes above it (its name, a date) is passed over where its cells are of another number than those of the rows.
    Excel's `sep=;` line is understood. Raises RecordingError where there is no header.
    """
    stated, lines = "", list[tuple[int, str]]()
    encoding = encoding_of(path)
    with path.open(encoding=encoding, newline="") as file:
        for number in range(1, 1000):
            line = file.readline(MAX_HEADER)
            if not line or len(line) == MAX_HEADER or len(lines) > PREAMBLE + LOOKED_AT:
                break
            text = line.strip("\r\n")
            if not text.strip() or text.lstrip().startswith("#"):
                continue
            if not lines and text.lower().startswith("sep=") and len(text) == 5:
                stated = text[4]
            elif not lines and "\0" in text:
                break
            else:
                lines.append((number, text))
    if not lines:
        raise RecordingError(f"{path}: has no header line: is it a CSV file? The first line names the columns, e.g. t_s,q1_rad,tau1_Nm")
    above = _above_header([text for _, text in lines], stated)
    line_number, header = lines[above]
    delimiter = stated or _delimiter(header)
    below = [text for _, text in lines[above + 1: above + 1 + LOOKED_AT]]
    return replace(_with_rows(Layout(tuple(cells(header, delimiter)), delimiter, line_number, encoding), below), above=above)


def _is_row(row: list[str]) -> bool:
    """Whether cells may be a row of numbers: numbers, times and empty cells."""
    return any(_NUMBER.fullmatch(cell) for cell in row) and all(not cell or cell[0].isdigit() or _NUMBER.fullmatch(cell) for cell in row)


def _above_header(lines: list[str], stated: str) -> int:
    """How many lines stand above the header: 0, unless the first row of numbers has other cells than the first line has."""
    try:
        first = cells(lines[0], stated or _delimiter(lines[0]))
        for k in range(2, len(lines)):
            delimiter = stated or _delimiter(lines[k - 1])
            names, row = cells(lines[k - 1], delimiter), cells(lines[k], delimiter)
            if len(row) < 2 or len(row) != len(names) or not _is_row(row) or any(_NUMBER.fullmatch(name) for name in names):
                continue
            if len(row) == len(first):
                return 0
            before = cells(lines[k - 2], delimiter)
            return k - 2 if len(before) == len(names) and _units_in(names, len(names)) and not _units_in(before, len(before)) else k - 1
    except csv.Error:
        return 0
    return 0


def _with_rows(layout: Layout, below: list[str]) -> Layout:
    """The layout as the first rows show it."""
    try:
        rows = [cells(line, layout.delimiter) for line in below]
    except csv.Error:
        return layout
    units = _units_in(rows[0], len(layout.names)) if rows else ()
    commas = any(_DECIMAL_COMMA.fullmatch(cell) for row in rows for cell in row)
    return Layout(layout.names, layout.delimiter, layout.line, layout.encoding, "," if (commas and layout.delimiter != ",") or any(
        _DECIMAL_COMMA.fullmatch(cell) for row in rows if len(row) == len(layout.names) for cell in row) else ".", units)
