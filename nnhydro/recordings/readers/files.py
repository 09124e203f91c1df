"""Which reader takes which file: the one place that knows the formats."""

from collections.abc import Callable
from pathlib import Path

from nnhydro.conventions import CHANNELS, CLOCK, TIME
from nnhydro.errors import RecordingError, require
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.readers.column_map import ColumnMap, campaign_map, in_stated_units, map_columns
from nnhydro.recordings.readers.csv_file import read_csv
from nnhydro.recordings.readers.from_columns import NamedColumns, recording_from_columns, steady_from_columns
from nnhydro.recordings.readers.hdf5_file import read_hdf5
from nnhydro.recordings.readers.parquet_file import read_parquet
from nnhydro.recordings.readers.ros_bag import read_bag
from nnhydro.recordings.readers.table import Request, Table, sha256_of
from nnhydro.recordings.recording import Origin, Recording, SteadyTable

FORMATS: dict[str, Callable[[Path, Request], Table]] = {
    ".csv": read_csv, ".tsv": read_csv, ".txt": read_csv,
    ".parquet": read_parquet, ".h5": read_hdf5, ".hdf5": read_hdf5, ".bag": read_bag, ".mcap": read_bag, ".db3": read_bag,
}
TORQUES = ("tau", "tau_sim", "tau_std")


def is_bag_folder(path: Path) -> bool:
    """Return whether `path` is a ROS 2 bag as recorded: a folder with metadata.yaml."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


def is_readable(path: Path) -> bool:
    """Return whether a reader takes `path`, by its name."""
    return is_bag_folder(path) or path.suffix.lower() in FORMATS


def channel_names(arm: Arm, torque: bool) -> frozenset[str]:
    """Return the names of the columns that a file of this arm may have."""
    names = {TIME, CLOCK}
    for key, channel in CHANNELS.items():
        if torque or key not in TORQUES:
            names.update([arm.column(key, j + 1) for j in range(arm.n_links)] if channel.per_joint else [channel.column()])
    return frozenset(names)


def _reader(path: Path) -> Callable[[Path, Request], Table]:
    if is_bag_folder(path):
        return read_bag
    if path.suffix.lower() not in FORMATS:
        raise RecordingError(f"{path}: unknown kind of file {path.suffix!r}: {', '.join(FORMATS)} are read; convert it")
    return FORMATS[path.suffix.lower()]


def _state(path: Path) -> list[tuple[str, int, int, int]]:
    """What a change of the file (or file in the folder) `path` would change: inode, size, time of writing; empty where it is gone."""
    if not path.exists():
        return []
    parts = [(part.name, part.stat()) for part in (sorted(path.iterdir()) if path.is_dir() else [path])]
    return [(name, stat.st_ino, stat.st_size, stat.st_mtime_ns) for name, stat in parts]


def _read(path: Path, arm: Arm, torque: bool, column_map: ColumnMap | None, steady: bool) -> tuple[NamedColumns, Origin]:
    """Columns under our names and in SI, and where they came from."""
    read = _reader(path)
    column_map = campaign_map(path) if column_map is None else column_map
    names = channel_names(arm, torque)
    sources = {} if column_map is None else column_map.sources(steady)
    if not torque:
        without = channel_names(arm, True) - names
        sources = {target: source for target, source in sources.items() if target not in without}
    wanted = names | {source.from_ for source in sources.values()}
    text = frozenset({"run"}) if steady else frozenset[str]()
    joints, topic = ((), None) if column_map is None else (column_map.settings.joints, column_map.settings.topic)
    try:
        before = _state(path)
        moments = [frozenset({sources[name].from_ if name in sources else name}) for name in (TIME, CLOCK)]
        table = read(path, Request(frozenset(wanted) - text, text, arm.n_links, joints, topic, *moments))
        mapped = {target: source.unit if source.unit is not None else table.units.get(source.from_) for target, source in sources.items()}
        stated = {name: unit for name, unit in mapped.items() if unit is not None}
        origin = Origin(str(path), sha256_of(path), path.suffix.lower().removeprefix(".") or "ros2",
                        tuple(name for name in table.header if name not in wanted | channel_names(arm, True) | text),
                        {name: unit for name, unit in table.units.items() if name in names} | stated,
                        {target: source.model_dump(by_alias=True, exclude_defaults=True) for target, source in sources.items()})
        require(_state(path) == before, f"{path}: changed while it was read, so its rows and its sha256 may differ: wait "
                "until the logger has closed it, then run again", RecordingError)
    except OSError as cause:
        raise RecordingError(f"{path}: cannot be read ({cause.strerror or cause}): check the path and its permissions") from cause
    steps = table.steps if not sources or column_map is None else (*table.steps, f"columns mapped by {column_map.path}")
    columns = map_columns(table, sources, str(path))
    return NamedColumns(in_stated_units(columns, table, sources, str(path)), table.header, table.first_row, steps), origin


def read_recording(path: Path, arm: Arm, torque: bool = True, column_map: ColumnMap | None = None) -> Recording:
    """Return the recording in `path`; without `torque`, its torque columns are not even looked at.

    `column_map` says what foreign columns mean; by default it is columns.yaml of the campaign that holds the file. Raises
    RecordingError (ConfigError for a faulty mapping) with one line.
    """
    named, origin = _read(path, arm, torque, column_map, steady=False)
    return recording_from_columns(named, arm, path.name if path.is_dir() else path.stem, origin, torque)


def read_steady(path: Path, arm: Arm, column_map: ColumnMap | None = None) -> SteadyTable:
    """Return the steady table in `path`. Raises RecordingError with one line."""
    named, origin = _read(path, arm, True, column_map, steady=True)
    return steady_from_columns(named, arm, path.stem, origin)
