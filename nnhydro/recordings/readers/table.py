"""Read a table of numbers (CSV or Parquet) into named columns, with the limits that files from outside need."""

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import CHANNELS, CLOCK, TIME
from nnhydro.errors import RecordingError

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Columns = dict[str, Array | tuple[str, ...]]
MAX_BYTES = 4_000_000_000
MAX_COLUMNS = 2_000
MAX_ROWS = 50_000_000
SUFFIXES = (".csv", ".parquet")


def sha256_of(path: Path) -> str:
    """Return the sha256 of the file `path` in hex, read in pieces."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while piece := file.read(1 << 20):
            digest.update(piece)
    return digest.hexdigest()


def read_table(path: Path, text: tuple[str, ...] = ()) -> Columns:
    """Return the columns of the CSV or Parquet file `path`; those named in `text` as strings, all others as float64 (empty: NaN).

    Raises RecordingError with one line naming the file, the column and the row of what cannot be a number.
    """
    import pandas as pd

    try:
        if path.stat().st_size > MAX_BYTES:
            raise RecordingError(f"{path}: larger than {MAX_BYTES} bytes: split the run")
        if path.suffix == ".parquet":
            import pyarrow.parquet as pq

            meta = pq.ParquetFile(path).metadata
            if meta.num_rows > MAX_ROWS or meta.num_columns > MAX_COLUMNS:
                raise RecordingError(f"{path}: {meta.num_rows} rows x {meta.num_columns} columns are too many for one run: split it")
            frame = pd.read_parquet(path)
        else:
            frame = pd.read_csv(path, dtype=dict.fromkeys(text, str), skipinitialspace=True, comment="#", encoding="utf-8-sig",
                                index_col=False, nrows=MAX_ROWS + 1)
    except OSError as cause:
        raise RecordingError(f"{path}: cannot be read ({cause.strerror or cause}): check the path and its permissions") from cause
    except UnicodeDecodeError as cause:
        raise RecordingError(f"{path}: is not UTF-8 text (byte {cause.start}): save it as UTF-8 CSV or as Parquet") from cause
    except (ValueError, pd.errors.ParserError, pd.errors.EmptyDataError) as cause:
        raise RecordingError(f"{path}: is not a readable table: {' '.join(str(cause).split())[:200]}") from cause
    if frame.shape[1] > MAX_COLUMNS or len(frame) > MAX_ROWS:
        raise RecordingError(f"{path}: {len(frame)} rows x {frame.shape[1]} columns are too many for one run: split it")
    return {str(name).strip(): _values(frame[name], str(name), path, name in text) for name in frame.columns}


def _values(series: "pd.Series", name: str, path: Path, text: bool) -> Array | tuple[str, ...]:
    """One column as numbers, or as strings; text in a column of the contract is refused, in a foreign column it becomes NaN."""
    import pandas as pd

    if text:
        return tuple(str(value) for value in series)
    values: Array = pd.to_numeric(series, errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    bad = np.flatnonzero(np.isnan(values) & series.notna().to_numpy())
    if len(bad) and name.strip() in _strict_names():
        row = int(bad[0])
        raise RecordingError(f"{path}: column {name!r}, row {row + 2}: {series.iloc[row]!r} is not a number: correct it or leave it empty")
    return values


def _strict_names() -> frozenset[str]:
    """Names of columns that must be numeric: those of the contract (others are kept out of the way)."""
    names = {TIME, CLOCK}
    for channel in CHANNELS.values():
        names.update(channel.column(j) for j in range(1, 11)) if channel.per_joint else names.add(channel.column())
    return frozenset(names)
