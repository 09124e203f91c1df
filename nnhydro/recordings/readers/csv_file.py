"""Text tables: comma, semicolon, tab or blanks between the columns, one header line, a row of units or none, `#` comments, decimal points
or commas, any encoding that can be recognised; times as seconds, or as dates and times of day."""

import csv
import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
from nnhydro.recordings.readers.text_layout import Layout, layout_of

if TYPE_CHECKING:
    import pandas as pd

_RAGGED = re.compile(r"Expected (\d+) fields in line (\d+), saw (\d+)")
_DATE = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}")
_MOMENT = re.compile(rf"(?:{_DATE.pattern}[T ]+)?\d{{1,2}}:\d\d(?::\d\d(?:\.\d*)?)?\s*(?:Z|[+-]\d\d:?\d\d)?$")
DAY = 86_400.0  # s
MINUS = "\N{MINUS SIGN}"  # as spreadsheets of some countries write it


def _lines(path: Path) -> int:
    """Number of line ends: rows that are shorter than the header still take a cell a column."""
    with path.open("rb") as file:
        return sum(piece.count(b"\n") for piece in iter(lambda: file.read(1 << 20), b"")) + 1


def _frame(path: Path, head: Layout, text: frozenset[str]) -> "pd.DataFrame":
    import pandas as pd

    major, minor = (int(part) for part in pd.__version__.split(".")[:2])
    exact: dict[str, Any] = {"float_precision": "round_trip"} if (major, minor) < (3, 1) else {}  # later ones are always exact
    kinds = {index: str for index, name in enumerate(head.names) if name in text}
    with warnings.catch_warnings():
        warnings.simplefilter("error", pd.errors.ParserWarning)  # rows longer than the header would be cut
        warnings.simplefilter("ignore", pd.errors.DtypeWarning)
        frame: pd.DataFrame = pd.read_csv(path, sep=head.delimiter, skiprows=head.first - 1, header=None, names=range(len(head.names)),
                                          dtype=kinds, skipinitialspace=True, comment="#", index_col=False,
                                          encoding="utf-8" if head.encoding == "utf-8-sig" else head.encoding, decimal=head.decimal,
                                          nrows=MAX_ROWS + 1, low_memory=False, **exact)
    return frame


def _explain(path: Path, head: Layout, cause: Exception) -> RecordingError:
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
        head = layout_of(path)
    except (UnicodeError, LookupError) as cause:
        raise _no_text(path, cause) from cause
    except csv.Error as cause:
        raise RecordingError(f"{path}: the header cannot be read ({cause}): save the file as plain CSV") from cause
    require_unique(path, head.names, request.numbers | request.text)
    require_shape(path, 1, len(head.names))
    require_plausible(path, 8 * len(head.names) * _lines(path))
    try:
        frame = _frame(path, head, request.text)
    except (UnicodeError, LookupError) as cause:
        raise _no_text(path, cause) from cause
    except (ValueError, OverflowError, pd.errors.ParserError, pd.errors.EmptyDataError, pd.errors.ParserWarning) as cause:
        raise _explain(path, head, cause) from cause
    require_shape(path, len(frame), len(head.names))
    columns: Columns = {}
    steps = list(head.said)
    for index, name in enumerate(head.names):
        if name in request.text:
            columns[name] = tuple(str(value) for value in frame[index])
        elif name in request.numbers:
            moments = name in request.times or name in request.clocks
            seconds = _seconds(frame[index], name in request.times) if moments else None
            columns[name] = _numbers(frame[index], name, path, head) if seconds is None else seconds
            since = " since the first row" if name in request.times else ""
            steps += [] if seconds is None else [f"{name}: dates and times of day in seconds{since}"]
    units = {name: unit for name, unit in zip(head.names, head.units, strict=True) if unit} if head.units else {}
    return Table(columns, head.names, head.first, tuple(steps), units)


def _no_text(path: Path, cause: Exception) -> RecordingError:
    place = f" (byte {cause.start})" if isinstance(cause, UnicodeDecodeError) else ""
    return RecordingError(f"{path}: is not UTF-8 text{place}, nor in the encoding of its beginning: save it as UTF-8 CSV or as Parquet")


def _moments(text: "pd.Series", iso: bool) -> "pd.Series[pd.Timestamp]":
    """Dates with times; those that are not ISO by the format of the first one, which is quick, else one by one."""
    import pandas as pd

    if iso:
        return pd.to_datetime(text, format="ISO8601", utc=True)
    try:
        return pd.to_datetime(text, dayfirst=True, utc=True)
    except ValueError:
        return pd.to_datetime(text, format="mixed", dayfirst=True, utc=True)


def _seconds(series: "pd.Series", since_start: bool) -> Array | None:
    """Dates and times of day in seconds, empty cells as NaN; None where the column holds something else.

    Seconds count from the first row (`since_start`), else from 1970 or from midnight. Days come before months where the date is written
    with dots or slashes. A time of day that falls by half a day has passed midnight.
    """
    import pandas as pd

    if series.dtype.kind in "biuf":
        return None
    text = series.astype(str).where(series.notna()).str.strip().str.replace(",", ".", regex=False)
    filled = text.dropna()
    if not len(filled) or not filled.str.match(_MOMENT).all():
        return None
    try:
        if filled.str.match(_DATE.pattern).all():
            when = _moments(text, bool(filled.str.match(r"\d{4}-").all()))
            start = when.dropna().iloc[0] if since_start else pd.Timestamp(0, tz="UTC")
            t = ((when - start) / pd.Timedelta(seconds=1)).to_numpy(dtype=float)
        else:
            of_day = pd.to_timedelta(text.where(text.str.count(":") != 1, text + ":00")) / pd.Timedelta(seconds=1)
            t = of_day.to_numpy(dtype=float)
            steps = np.diff(t, prepend=t[:1])
            t = t + DAY * np.cumsum(np.nan_to_num(steps) < -DAY / 2)
            t = t - (t[np.isfinite(t)][0] if since_start else 0.0)
    except (ValueError, OverflowError, TypeError):
        return None
    return np.asarray(t, dtype=float)


def _numbers(series: "pd.Series", name: str, path: Path, head: Layout) -> Array:
    """One column as float64, empty cells as NaN; raises RecordingError at the first cell that is no number."""
    import pandas as pd

    if series.dtype.kind == "b":
        raise wrong_kind(path, name, "true/false values")
    if series.dtype.kind in "iuf":
        return series.to_numpy(dtype=float)
    text = series.astype(str).where(series.notna()).str.replace(MINUS, "-", regex=False)
    text = text.str.replace(",", ".", regex=False) if head.decimal == "," else text
    values: Array = pd.to_numeric(text, errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    bad = np.flatnonzero(np.isnan(values) & series.notna().to_numpy())
    if len(bad):
        row = int(bad[0])
        raise not_a_number(path, name, head.first + row, series.iloc[row])
    return values
