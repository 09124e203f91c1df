"""Which reader takes which file: the one place that knows the formats."""

from pathlib import Path

from nnhydro.errors import RecordingError
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.readers.from_columns import recording_from_columns, steady_from_columns
from nnhydro.recordings.readers.table import SUFFIXES, Columns, read_table, sha256_of
from nnhydro.recordings.recording import Origin, Recording, SteadyTable


def _columns(path: Path, text: tuple[str, ...] = ()) -> tuple[Columns, Origin]:
    if path.suffix not in SUFFIXES:
        raise RecordingError(f"{path}: unknown kind of file {path.suffix!r}: {', '.join(SUFFIXES)} are read")
    columns = read_table(path, text)
    return columns, Origin(str(path), sha256_of(path), path.suffix.removeprefix("."))


def read_recording(path: Path, arm: Arm, torque: bool = True) -> Recording:
    """Return the recording in `path`; with `torque`, its torque columns are required. Raises RecordingError with one line."""
    columns, origin = _columns(path)
    return recording_from_columns(columns, arm, path.stem, origin, torque)


def read_steady(path: Path, arm: Arm) -> SteadyTable:
    """Return the steady table in `path`. Raises RecordingError with one line."""
    columns, origin = _columns(path, ("run",))
    return steady_from_columns(columns, arm, path.stem, origin)
