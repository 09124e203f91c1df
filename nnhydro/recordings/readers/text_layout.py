"""How a table of text is laid out: encoding, separator, decimal sign, a row of units. Nothing is assumed that can be seen."""

import codecs
import csv
import re
from dataclasses import dataclass
from pathlib import Path
from typing import final

from nnhydro.errors import RecordingError

MAX_HEADER = 1_000_000  # characters: a longer first line is no header
SAMPLE = 65_536  # bytes that tell the encoding
LOOKED_AT = 20  # rows below the header that tell the decimal sign
BOMS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"), (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"))
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+(?:[eE][+-]?\d+)?\s*")
_NUMBER = re.compile(r"\s*[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?\s*|\s*[+-]?(?:nan|inf|infinity)\s*", re.IGNORECASE)
_UNIT = re.compile(r"[\[(<]?\s*([A-Za-z%\u00b0\u00b5][\w%\u00b0\u00b5\u00b2\u00b7*^/ .\-]{0,11})\s*[\])>]?")


@final
@dataclass(frozen=True)
class Layout:
    """What a text table looks like; `line` is the number of the header line, `first` that of the first row of numbers, counted from 1."""

    names: tuple[str, ...]
    delimiter: str
    line: int
    encoding: str
    decimal: str = "."
    units: tuple[str, ...] = ()

    @property
    def first(self) -> int:
        """Number of the first line of data."""
        return self.line + (2 if self.units else 1)

    @property
    def said(self) -> tuple[str, ...]:
        """What a reader should know of how the file was read."""
        told = []
        if self.encoding not in ("utf-8", "utf-8-sig"):
            told.append(f"text in {self.encoding}")
        if self.decimal == ",":
            told.append("decimal commas")
        if self.units:
            told.append("units from the row below the header")
        return tuple(told)


def encoding_of(path: Path) -> str:
    """Return the encoding of the text file `path`: by its byte-order mark, as UTF-8, else as a library guesses."""
    with path.open("rb") as file:
        sample = file.read(SAMPLE)
    marked = next((name for bom, name in BOMS if sample.startswith(bom)), "")
    if marked:
        return marked
    even, odd = sample[0::2].count(0), sample[1::2].count(0)
    if max(even, odd) > 0.4 * len(sample) / 2 and min(even, odd) < 0.05 * len(sample) / 2:
        return "utf-16-le" if odd > even else "utf-16-be"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(sample)
        return "utf-8"
    except UnicodeDecodeError as cause:
        place = cause.start
    if b"\0" not in sample:
        from charset_normalizer import from_bytes

        found = from_bytes(sample).best()
        if found is not None:
            return str(found.encoding)
    raise RecordingError(f"{path}: is not UTF-8 text (byte {place}), nor in any encoding that can be recognised: save it as UTF-8 CSV "
                         "or as Parquet")


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

    Excel's `sep=;` line is understood. Raises RecordingError where there is no header.
    """
    stated, below = "", list[str]()
    encoding = encoding_of(path)
    names: tuple[str, ...] = ()
    delimiter, line_number = "", 0
    with path.open(encoding=encoding, newline="") as file:
        for number in range(1, 1000):
            line = file.readline(MAX_HEADER)
            if not line or len(line) == MAX_HEADER or len(below) == LOOKED_AT:
                break
            text = line.strip("\r\n")
            if not text.strip() or text.lstrip().startswith("#"):
                continue
            if names:
                below.append(text)
            elif text.lower().startswith("sep=") and len(text) == 5:
                stated = text[4]
            elif "\0" in text:
                break
            else:
                delimiter, line_number = stated or _delimiter(text), number
                names = tuple(cells(text, delimiter))
    if not names:
        raise RecordingError(f"{path}: has no header line: is it a CSV file? The first line names the columns, e.g. t_s,q1_rad,tau1_Nm")
    return _with_rows(Layout(names, delimiter, line_number, encoding), below)


def _with_rows(layout: Layout, below: list[str]) -> Layout:
    """The layout with what the first rows tell."""
    try:
        rows = [cells(line, layout.delimiter) for line in below]
    except csv.Error:
        return layout
    units = _units_in(rows[0], len(layout.names)) if rows else ()
    commas = any(_DECIMAL_COMMA.fullmatch(cell) for row in rows for cell in row)
    return Layout(layout.names, layout.delimiter, layout.line, layout.encoding, "," if (commas and layout.delimiter != ",") or any(
        _DECIMAL_COMMA.fullmatch(cell) for row in rows if len(row) == len(layout.names) for cell in row) else ".", units)
