"""ROS 1 bags, ROS 2 bags (.db3, .mcap, or the folder with metadata.yaml): sensor_msgs/JointState as a recording.

    name -> joint, position -> q, velocity -> dq, effort -> tau, header stamp -> t_s, counted from the first message

Which name is which joint is said by `joints: [shoulder, elbow]` in the column mapping, from the base outwards; names that end in
1 ... n (joint1, joint2) need no mapping. Every channel can also be mapped as `shoulder.position`, `elbow.effort`.
Needs rosbags (`pip install 'nnhydro[ros]'`). The message: docs.ros.org, sensor_msgs/msg/JointState.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nnhydro.conventions import TIME, column
from nnhydro.errors import NnhydroError, RecordingError, missing_extra
from nnhydro.recordings.readers.table import Array, Columns, Request, Table, require_shape, require_size
from nnhydro.recordings.readers.unpacking import limit_rosbags

KINDS = ("sensor_msgs/msg/JointState", "sensor_msgs/JointState")
CHANNELS = {"position": "q", "velocity": "qd", "effort": "tau"}


class _Message(NamedTuple):
    stamp: int  # ns, of the header
    logged: int  # ns, when it was written
    names: tuple[str, ...]
    values: dict[str, Array]  # position, velocity, effort, each as long as names or empty


def _messages(path: Path, topic: str | None) -> Iterator[_Message]:
    """Every JointState message of one topic in the order of the log."""
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2
    from rosbags.typesys import Stores, get_typestore

    limit_rosbags()
    old = path.suffix.lower() == ".bag" and path.is_file()
    types = get_typestore(Stores.ROS1_NOETIC if old else Stores.ROS2_HUMBLE)
    with (Reader1(path) if old else Reader2(path)) as reader:
        there = sorted({connection.topic for connection in reader.connections if connection.msgtype in KINDS})
        chosen = _topic(path, there, topic, sorted({connection.msgtype for connection in reader.connections}))
        connections = [connection for connection in reader.connections if connection.topic == chosen and connection.msgtype in KINDS]
        for connection, logged, raw in reader.messages(connections=connections):
            read = types.deserialize_ros1 if old else types.deserialize_cdr
            m: Any = read(raw, connection.msgtype)
            yield _Message(int(m.header.stamp.sec) * 10**9 + int(m.header.stamp.nanosec), int(logged), tuple(str(n) for n in m.name),
                           {channel: np.asarray(getattr(m, channel), dtype=float) for channel in CHANNELS})


def _require_tables_alone(path: Path) -> None:
    """Raise RecordingError where a .db3 holds queries of its own: a view may compute without end."""
    import sqlite3

    with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as database:
        found = database.execute("SELECT type, name FROM sqlite_master WHERE type NOT IN ('table', 'index')").fetchone()
    if found is not None:
        raise RecordingError(f"{path}: holds the {found[0]} {found[1]!r:.60}, which no recorder writes: export its joint states to CSV")


def _topic(path: Path, there: Sequence[str], asked: str | None, kinds: Sequence[str]) -> str:
    """The topic with joint states: the one asked for, or the only one; raises RecordingError otherwise."""
    if not there:
        raise RecordingError(f"{path}: holds no sensor_msgs/JointState messages (it has {', '.join(kinds[:4]) or 'none at all'}): "
                             "record the joint states with effort")
    if asked is None and len(there) > 1:
        raise RecordingError(f"{path}: has {len(there)} topics with joint states ({', '.join(there[:4])}): "
                             "choose one by 'topic: ...' in a mapping (--map FILE)")
    if asked is not None and asked not in there:
        raise RecordingError(f"{path}: has no joint states on topic {asked!r}, but on {', '.join(there[:4])}: "
                             "correct 'topic:' in the mapping")
    return there[0] if asked is None else asked


def order_by_number(names: Sequence[str], links: int) -> tuple[str, ...]:
    """Return `names` ordered by the number they end in, if these are exactly 1 ... `links`, else ()."""
    by_number = {int(match[1]): name for name in names if (match := re.search(r"(\d{1,3})$", name))}
    return tuple(by_number[k] for k in sorted(by_number)) if len(names) == links and sorted(by_number) == list(range(1, links + 1)) else ()


def _channel(messages: Sequence[_Message], joint: str, channel: str) -> Array | None:
    """One channel of one joint (n,), NaN where a message leaves it out; None where all do."""
    values = np.full(len(messages), np.nan)
    for row, message in enumerate(messages):
        array = message.values[channel]
        if joint in message.names and len(array) == len(message.names):
            values[row] = array[message.names.index(joint)]
    return None if np.isnan(values).all() else values


def _time(messages: Sequence[_Message]) -> tuple[Array, str]:
    """Seconds since the first message, by the stamp of the sensor where it has one, else by that of arrival."""
    stamps = np.array([message.stamp for message in messages], dtype=np.int64)
    stamped = bool(stamps.any())
    if not stamped:
        stamps = np.array([message.logged for message in messages], dtype=np.int64)
    return (stamps - stamps[0]) / 1e9, "time from the header stamps" if stamped else "time of logging: the header stamps are all 0"


def _table(path: Path, messages: list[_Message], request: Request) -> Table:
    """Angles, rates and efforts of the chosen joints, one row a message."""
    names = list(dict.fromkeys(name for message in messages for name in message.names))
    joints = request.joints or order_by_number(names, request.links)
    unknown = [joint for joint in joints if joint not in names]
    if unknown:
        raise RecordingError(f"{path}: has no joint {unknown[0]!r}, but {', '.join(names[:8])}: correct 'joints:' in the mapping")
    mapped = any(f"{name}.{channel}" in request.numbers for name in names for channel in CHANNELS)
    if not joints and not mapped:
        raise RecordingError(f"{path}: its joints are {', '.join(names[:8]) or '(unnamed)'}: "
                             "say which is which by 'joints: [...]' in a mapping (--map FILE)")
    wanted = [message for message in messages if not joints or set(joints) & set(message.names)]
    require_shape(path, len(wanted), len(names) * len(CHANNELS))
    t, how = _time(wanted)
    columns: Columns = {TIME: t}
    header = [TIME]
    for name in names:
        for channel, ours in CHANNELS.items():
            targets = {f"{name}.{channel}"} | ({column(ours, joints.index(name) + 1)} if name in joints else set())
            header += sorted(targets)
            values = _channel(wanted, name, channel) if targets & request.numbers else None
            columns |= {target: values for target in targets & request.numbers if values is not None}
    skipped = len(messages) - len(wanted)
    steps = (f"joint states of {', '.join(joints)}" if joints else "joint states", how)
    return Table(columns, tuple(header), steps=(*steps, f"{skipped} messages of other joints left out") if skipped else steps)


def read_bag(path: Path, request: Request) -> Table:
    """Return the joint states in the bag `path` as columns; raises RecordingError naming the file, the topic or the joint."""
    try:
        import rosbags  # noqa: F401
    except ImportError:
        missing_extra("rosbags", "ros", f"{path}: reading ROS bags")
    for part in sorted(path.iterdir()) if path.is_dir() else [path]:
        require_size(part)
    try:
        for part in path.glob("*.db3") if path.is_dir() else [path] if path.suffix.lower() == ".db3" else []:
            _require_tables_alone(part)
        return _table(path, list(_messages(path, request.topic)), request)
    except NnhydroError as error:
        raise error if str(path) in str(error) else RecordingError(f"{path}: {error}") from None
    except Exception as cause:  # a damaged bag fails in sqlite, zstd, lz4, struct or rosbags, which share no base class
        raise RecordingError(f"{path}: is not a readable ROS bag ({' '.join(str(cause).split())[:160] or type(cause).__name__}): "
                             "record it again or convert it to CSV") from cause
