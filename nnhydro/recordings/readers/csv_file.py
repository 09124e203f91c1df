"""CSV: comma, semicolon or tab between the columns, one header line, `#` comments, UTF-8 with or without a byte-order mark."""

import csv
import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from nnhydro.errors import RecordingError
from nnhydro.recordings.readers.table import (
    MAX_ROWS,
    Array,
    Columns,
    Request,
    Table,
    not_a_number,
    require_plausible,
    require_shape,
    require_size,
    require_unique,
    wrong_kind,
)

if TYPE_CHECKING:
    import pandas as pd

MAX_HEADER = 1_000_000  # characters: a longer first line is no header
_RAGGED = re.compile(r"Expected (\d+) fields in line (\d+), saw (\d+)")


class _Head(NamedTuple):
    names: tuple[str, ...]
    delimiter: str
    line: int  # number of the header line, counted from 1


def _delimiter(line: str) -> str:
    """The separator that the header uses most, quoted parts aside."""
    bare = re.sub(r'"[^"]*"', "", line)
    return max((",", ";", "\t"), key=bare.count)


def _head(path: Path) -> _Head:
    """The header: the first line that is neither blank nor a comment; Excel's `sep=;` line is understood."""
    stated = ""
    with path.open(encoding="utf-8-sig", newline="") as file:
        for number in range(1, 1000):
            line = file.readline(MAX_HEADER)
            if not line or len(line) == MAX_HEADER:
                break
            text = line.strip("\r\n")
            if text.lower().startswith("sep=") and len(text) == 5:
                stated = text[4]
            elif text.strip() and not text.lstrip().startswith("#"):
                if "\0" in text:
                    break
                delimiter = stated or _delimiter(text)
                names = next(csv.reader([text], delimiter=delimiter, skipinitialspace=True))
                return _Head(tuple(name.strip() for name in names), delimiter, number)
    raise RecordingError(f"{path}: has no header line: is it a CSV file? The first line names the columns, e.g. t_s,q1_rad,tau1_Nm")


def _lines(path: Path) -> int:
    """Number of line ends: rows that are shorter than the header still take a cell a column."""
    with path.open("rb") as file:
        return sum(piece.count(b"\n") for piece in iter(lambda: file.read(1 << 20), b"")) + 1


def _frame(path: Path, head: _Head, text: frozenset[str]) -> "pd.DataFrame":
    import pandas as pd

    major, minor = (int(part) for part in pd.__version__.split(".")[:2])
    exact: dict[str, Any] = {"float_precision": "round_trip"} if (major, minor) < (3, 1) else {}  # later ones are always exact
    kinds = {index: str for index, name in enumerate(head.names) if name in text}
    with warnings.catch_warnings():
        warnings.simplefilter("error", pd.errors.ParserWarning)  # rows longer than the header would be cut
        warnings.simplefilter("ignore", pd.errors.DtypeWarning)
        frame: pd.DataFrame = pd.read_csv(path, sep=head.delimiter, skiprows=head.line, header=None, names=range(len(head.names)),
                                          dtype=kinds, skipinitialspace=True, comment="#", encoding="utf-8", index_col=False,
                                          nrows=MAX_ROWS + 1, low_memory=False, **exact)
    return frame


def _explained(path: Path, head: _Head, cause: Exception) -> RecordingError:
    """The parser's complaint in our words."""
    said = " ".join(str(cause).split())
    ragged = _RAGGED.search(said)
    comma = " (a decimal comma? save with decimal points)" if head.delimiter == "," else ""
    if ragged:
        return RecordingError(f"{path}: row {ragged[2]} has {ragged[3]} fields, the header has {len(head.names)}: repair the row{comma}")
    if "Length of header or names" in said:
        return RecordingError(f"{path}: the rows have more fields than the header ({len(head.names)}): name every column{comma}")
    if "EOF inside string" in said:
        row = re.search(r"starting at row (\d+)", said)
        place = f"row {int(row[1]) + 1}: " if row else ""
        return RecordingError(f"{path}: {place}a quotation mark is opened and never closed: remove it")
    if "No columns to parse" in said:
        return RecordingError(f"{path}: holds a header but no rows: the log was cut off; remove the file or record again")
    return RecordingError(f"{path}: is not a readable table: {said[:200]}: open it in an editor and save it as plain CSV")


def read_csv(path: Path, request: Request) -> Table:
    """Return the requested columns of the CSV file `path`; raises RecordingError naming the file, the column and the row."""
    import pandas as pd

    require_size(path)
    try:
        head = _head(path)
    except UnicodeDecodeError as cause:
        raise RecordingError(f"{path}: is not UTF-8 text (byte {cause.start}): save it as UTF-8 CSV or as Parquet") from cause
    except csv.Error as cause:
        raise RecordingError(f"{path}: the header cannot be read ({cause}): save the file as plain CSV") from cause
    require_unique(path, head.names, request.numbers | request.text)
    require_shape(path, 1, len(head.names))
    require_plausible(path, 8 * len(head.names) * _lines(path))
    try:
        frame = _frame(path, head, request.text)
    except UnicodeDecodeError as cause:
        raise RecordingError(f"{path}: is not UTF-8 text (byte {cause.start}): save it as UTF-8 CSV or as Parquet") from cause
    except (ValueError, OverflowError, pd.errors.ParserError, pd.errors.EmptyDataError, pd.errors.ParserWarning) as cause:
        raise _explained(path, head, cause) from cause
    require_shape(path, len(frame), len(head.names))
    columns: Columns = {}
    for index, name in enumerate(head.names):
        if name in request.text:
            columns[name] = tuple(str(value) for value in frame[index])
        elif name in request.numbers:
            columns[name] = _numbers(frame[index], name, path, head.line + 1)
    return Table(columns, head.names, head.line + 1)


def _numbers(series: "pd.Series", name: str, path: Path, first_row: int) -> Array:
    """One column as float64, empty cells as NaN; raises RecordingError at the first cell that is no number."""
    import pandas as pd

    if series.dtype.kind == "b":
        raise wrong_kind(path, name, "true/false values")
    if series.dtype.kind in "iuf":
        return series.to_numpy(dtype=float)
    values: Array = pd.to_numeric(series.astype(str).where(series.notna()), errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    bad = np.flatnonzero(np.isnan(values) & series.notna().to_numpy())
    if len(bad):
        row = int(bad[0])
        raise not_a_number(path, name, first_row + row, series.iloc[row])
    return values
