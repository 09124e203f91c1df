"""Apache Parquet: one column per channel; only the requested columns are read."""

from pathlib import Path
from typing import Any

import numpy as np

from nnhydro.errors import RecordingError, require
from nnhydro.recordings.readers.table import (
    MAX_TEXT,
    Array,
    Columns,
    Request,
    Table,
    require_plausible,
    require_shape,
    require_size,
    require_unique,
    too_much_text,
    wrong_kind,
)


def _numbers(column: Any, name: str, path: Path) -> Array:
    """One Arrow column as float64, nulls as NaN; raises RecordingError where it does not hold real numbers."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan)
    if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)):
        raise wrong_kind(path, name, f"{kind} values")
    if pa.types.is_decimal(kind):
        column = column.cast(pa.float64())
    return np.asarray(column.to_numpy(zero_copy_only=False) if isinstance(column, pa.Array) else column.to_numpy(), dtype=float)


def _words(column: Any, name: str, path: Path) -> tuple[str, ...]:
    """A column of names; raises RecordingError where few long texts stand in very many rows."""
    import pyarrow as pa

    if pa.types.is_dictionary(column.type) and pa.types.is_string(column.type.value_type):
        longest = max((len(text) for chunk in column.chunks for text in chunk.dictionary.to_pylist() if text is not None), default=0)
        if longest * len(column) > MAX_TEXT:
            raise too_much_text(path, name)
    return tuple(str(value) for value in column.to_pylist())


def read_parquet(path: Path, request: Request) -> Table:
    """Return the requested columns of the Parquet file `path`; raises RecordingError naming the file and the column."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    require_size(path)
    try:
        with pq.ParquetFile(path) as file:
            header = tuple(str(name) for name in file.schema_arrow.names)
            require_unique(path, header, request.numbers | request.text)
            require_shape(path, file.metadata.num_rows, len(header))
            chosen = [name for name in header if name in request.numbers | request.text]
            require_plausible(path, 8 * file.metadata.num_rows * len(chosen))
        with pq.ParquetFile(path, read_dictionary=[name for name in chosen if name in request.text]) as file:
            data = file.read(columns=chosen)
    except (OSError, ValueError, KeyError, pa.ArrowException) as cause:
        raise RecordingError(f"{path}: is not a readable Parquet file ({' '.join(str(cause).split())[:160]}): write it again") from cause
    missing = [name for name in chosen if name not in data.column_names]
    require(not missing, f"{path}: declares the column {', '.join(missing[:1])} but does not hold it: the file is damaged, write it again",
            RecordingError)
    columns: Columns = {}
    for name in chosen:
        column = data.column(name)
        columns[name] = _words(column, name, path) if name in request.text else _numbers(column, name, path)
    return Table(columns, header)
