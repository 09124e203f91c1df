"""HDF5: one dataset a column, at the root or in one group; a table (compound) dataset; or an (n, k) array as name[1] ... name[k].

Datasets in deeper groups are called `group/name`. Links into other files, external and virtual storage are refused: a recording is
one file. Needs h5py (`pip install 'nnhydro[hdf5]'`).
"""

from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from nnhydro.errors import RecordingError, missing_extra
from nnhydro.recordings.readers.table import (
    MAX_COLUMNS,
    MAX_TEXT,
    Array,
    Columns,
    Request,
    Table,
    require_plausible,
    require_shape,
    require_size,
    too_much_text,
    wrong_kind,
)

DEPTH = 4  # groups within groups

Read = Callable[[], Any]


def _datasets(group: Any, path: Path, prefix: str = "", depth: int = DEPTH) -> Iterator[tuple[str, Any]]:
    """Every dataset below `group` with its name; raises RecordingError at a link that leaves the file."""
    import h5py

    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            raise RecordingError(f"{path}: {prefix + name!r} is a link into another file: copy the data into this one")
        if isinstance(link, h5py.SoftLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group) and depth > 1:
            yield from _datasets(item, path, f"{prefix}{name}/", depth - 1)
        elif isinstance(item, h5py.Dataset):
            if item.is_virtual or item.external:
                raise RecordingError(f"{path}: {prefix + name!r} is stored in another file: copy the data into this one")
            yield prefix + name, item


def _columns_of(name: str, dataset: Any) -> Iterator[tuple[str, Any, Any, Read]]:
    """(name, dataset, dtype, how to read it) of every column that one dataset holds."""
    if dataset.dtype.names and dataset.ndim == 1:
        for part in dataset.dtype.names:
            yield part, dataset, dataset.dtype[part], partial(dataset.__getitem__, part)
    elif dataset.ndim == 1:
        yield name, dataset, dataset.dtype, partial(dataset.__getitem__, slice(None))
    elif dataset.ndim == 2 and dataset.shape[1] <= MAX_COLUMNS:
        for k in range(dataset.shape[1]):
            yield f"{name}[{k + 1}]", dataset, dataset.dtype, partial(dataset.__getitem__, (slice(None), k))


def _bytes(dataset: Any, kind: Any) -> int:
    """What reading one column takes: its rows as float64, and a whole chunk (compressed) or record (compound) at a time."""
    chunk = int(prod(dataset.chunks)) * int(dataset.dtype.itemsize) if dataset.chunks else 0
    return int(dataset.shape[0]) * max(8, int(kind.itemsize)) + chunk


def _without_common_group(names: list[str]) -> dict[str, str]:
    """Short name of every dataset: the group is left out where all share one."""
    groups = {name.rpartition("/")[0] for name in names}
    return {name: name.rpartition("/")[2] if len(groups) == 1 else name for name in names}


def _words(path: Path, name: str, dataset: Any, of: tuple[str, ...]) -> Iterator[str]:
    """A column of names, row by row: all rows may point to one long text, which only its copies show."""
    length = 0
    for row in range(dataset.shape[0]):
        value = dataset[(*of, row)]
        length += len(value) if isinstance(value, (bytes, str)) else 0
        if length > MAX_TEXT:
            raise too_much_text(path, name)
        yield value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _value(path: Path, name: str, dataset: Any, kind: Any, read: Read, text: bool) -> Array | tuple[str, ...]:
    """One column of a dataset as numbers or words; raises RecordingError for another type."""
    if text:
        return tuple(_words(path, name, dataset, (name,) if dataset.dtype.names else ()))
    if kind.kind not in "iuf":
        raise wrong_kind(path, name, {"b": "true/false values", "c": "complex numbers"}.get(kind.kind, "text or objects"))
    return np.asarray(read(), dtype=float)


def _table(file: Any, path: Path, request: Request) -> Table:
    """The requested columns, datasets named without the group that all share."""
    datasets = dict(_datasets(file, path))
    short = _without_common_group(list(datasets))
    found = [column for name, dataset in datasets.items() for column in _columns_of(short[name], dataset)]
    header = tuple(name for name, *_ in found)
    wanted = [column for column in found if column[0] in request.numbers | request.text]
    if not wanted:
        seen = ", ".join(map(repr, header[:6])) or "no datasets"
        raise RecordingError(f"{path}: holds none of the columns that are needed (it has {seen}): rename them or give --map FILE")
    rows = Counter(dataset.shape[0] for _, dataset, *_ in wanted).most_common(1)[0][0]
    require_shape(path, rows, len(header))
    require_plausible(path, sum(_bytes(dataset, kind) for _, dataset, kind, _ in wanted))
    columns: Columns = {}
    for name, dataset, kind, read in wanted:
        if (n := dataset.shape[0]) != rows:
            raise RecordingError(f"{path}: dataset {name!r} has {n} rows, the others {rows}: columns of one run must be equally long")
        if name in columns:
            raise RecordingError(f"{path}: column {name!r} appears twice: rename or remove one")
        columns[name] = _value(path, name, dataset, kind, read, name in request.text)
    return Table(columns, header)


def read_hdf5(path: Path, request: Request) -> Table:
    """Return the requested columns of the HDF5 file `path`; raises RecordingError naming the file and the dataset."""
    try:
        import h5py
    except ImportError:
        missing_extra("h5py", "hdf5", f"{path}: reading HDF5")
    require_size(path)
    try:
        with h5py.File(path, "r", locking=False) as file:
            return _table(file, path, request)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as cause:
        raise RecordingError(f"{path}: is not a readable HDF5 file ({' '.join(str(cause).split())[:160]}): write it again") from cause
