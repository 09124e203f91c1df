"""A table of named columns as readers hand it on, the limits that files from outside need, and what counts as a number."""

import hashlib
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import RecordingError

Array = NDArray[np.float64]
Columns = dict[str, Array | tuple[str, ...]]
MAX_BYTES = 4_000_000_000
MAX_COLUMNS = 2_000
MAX_ROWS = 50_000_000
HARMLESS = 150_000_000  # bytes of numbers that any file may hold
MAX_RATIO = 50  # bytes of numbers a byte of file: measured numbers are noisy and compress ten times at the best
MAX_TEXT = 50_000_000  # characters of a column of names
FIRST_ROW = 2  # rows are counted as in a spreadsheet: the header is row 1
_TIME_OF_DAY = re.compile(r"\s*(\d{4}-\d\d-\d\d|\d{1,2}:\d\d)")
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+\s*$")


@final
@dataclass(frozen=True)
class Request:
    """What a reader is asked for: columns of numbers, columns of text, and the joints of a robot's joint-state log by name."""

    numbers: frozenset[str]
    text: frozenset[str] = frozenset()
    links: int = 1
    joints: tuple[str, ...] = ()  # names in a JointState log, from the base outwards
    topic: str | None = None
    times: frozenset[str] = frozenset()  # columns that may hold dates or times of day: read as seconds since the first row
    clocks: frozenset[str] = frozenset()  # the same, as seconds since 1970 or midnight


@final
@dataclass(frozen=True)
class Table:
    """The requested columns that were there, the names of all columns, what the reader did, and the units that the file states."""

    columns: Columns
    header: tuple[str, ...]
    first_row: int = FIRST_ROW
    steps: tuple[str, ...] = ()
    units: dict[str, str] = field(default_factory=dict)  # column: unit as written below its name


Reader = Callable[[Path, Request], Table]


def sha256_of(path: Path) -> str:
    """Return the sha256 of the file `path` (or of all files of the folder `path`) in hex, read in pieces."""
    digest = hashlib.sha256()
    for part in sorted(path.iterdir()) if path.is_dir() else [path]:
        if not part.is_file():
            continue
        with part.open("rb") as file:
            while piece := file.read(1 << 20):
                digest.update(piece)
    return digest.hexdigest()


def require_size(path: Path) -> None:
    """Raise RecordingError where `path` is no regular file, empty or larger than one run may be."""
    if not path.is_file():
        raise RecordingError(f"{path}: {'is not a regular file' if path.exists() else 'does not exist'}: check the path (a broken link?)")
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise RecordingError(f"{path}: holds {size} bytes, more than {MAX_BYTES}: split the run into several files")
    if size == 0:
        raise RecordingError(f"{path}: is empty: the log was never written; remove the file or record again")


def require_shape(path: Path, rows: int, columns: int) -> None:
    """Raise RecordingError where a table is too large for one run, or has no rows."""
    if rows > MAX_ROWS or columns > MAX_COLUMNS:
        raise RecordingError(f"{path}: {rows} rows x {columns} columns are too many (limits {MAX_ROWS}, {MAX_COLUMNS}): split the run")
    if rows == 0:
        raise RecordingError(f"{path}: holds a header but no rows: the log was cut off; remove the file or record again")


def require_plausible(path: Path, unpacked: int) -> None:
    """Raise RecordingError where a file would become `unpacked` bytes of numbers, far more than measurements of its size can hold.

    A few kilobytes of a compressed or sparse format can fill any memory.
    """
    size = path.stat().st_size
    if unpacked > max(HARMLESS, MAX_RATIO * size):
        raise RecordingError(f"{path}: its {size} bytes would become {unpacked:.3g} bytes of numbers: damaged, or made to fill the memory; "
                             "write it again without empty rows and columns")


def require_unique(path: Path, header: Sequence[str], wanted: frozenset[str]) -> None:
    """Raise RecordingError where a wanted column stands twice in the header: it is unclear which one is meant."""
    twice = [name for name, count in Counter(header).items() if count > 1 and name in wanted]
    if twice:
        raise RecordingError(f"{path}: column {twice[0]!r} appears {Counter(header)[twice[0]]} times: rename or remove one")


def not_a_number(path: Path, name: str, row: int, value: Any) -> RecordingError:
    """Return the error for a cell that is no number, with the likely cause."""
    text = repr(value)[:60]
    if isinstance(value, str) and _DECIMAL_COMMA.match(value):
        return RecordingError(f"{path}: column {name!r}, row {row}: {text} has a decimal comma: save the file with decimal points")
    if isinstance(value, str) and _TIME_OF_DAY.match(value):
        return RecordingError(f"{path}: column {name!r}, row {row}: {text} is a date or time of day: write seconds since the start")
    return RecordingError(f"{path}: column {name!r}, row {row}: {text} is not a number: correct it or leave it empty")


def too_much_text(path: Path, name: str) -> RecordingError:
    """Return the error for a column of names that holds more than MAX_TEXT characters."""
    return RecordingError(f"{path}: column {name!r} holds more than {MAX_TEXT} characters: is it a column of short names?")


def wrong_kind(path: Path, name: str, kind: str) -> RecordingError:
    """Return the error for a column that holds `kind` instead of real numbers."""
    remedy = "write seconds since the start" if "time" in kind or "date" in kind else "write plain real numbers"
    return RecordingError(f"{path}: column {name!r} holds {kind}, not real numbers: {remedy}")
