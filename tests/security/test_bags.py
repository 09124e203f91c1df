"""ROS bags whose chunks would unpack to gigabytes: stopped on the way, in every container and compression that a bag can have."""

import bz2
import io
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from backports import zstd
from lz4.frame import LZ4FrameDecompressor
from lz4.frame import compress as lz4_compress
from planted import the_arm

from nnhydro.errors import RecordingError
from nnhydro.recordings.readers import unpacking
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.readers.unpacking import _LimitedFile, unpack

ARM = the_arm(links=(the_arm().links[0],))
KINDS = ("bag bz2", "bag lz4", "mcap storage", "db3 message", "db3 file")


def bag(folder: Path, kind: str, zeros: int = 0, rows: int = 12) -> Path:
    """Write a bag of joint states compressed as `kind` says; the name of its last message is followed by so many zeros."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    container, how = kind.split()
    old = container == "bag"
    store = get_typestore(Stores.ROS1_NOETIC if old else Stores.ROS2_HUMBLE)
    State, Header, Time = (store.types[f"{name}"] for name in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header",
                                                               "builtin_interfaces/msg/Time"))
    path = folder / ("x.bag" if old else "x")
    writer = Writer1(path) if old else Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP if container == "mcap" else
                                               StoragePlugin.SQLITE3)
    if old:
        writer.set_compression(Writer1.CompressionFormat[how.upper()])
    else:
        writer.set_compression(CompressionMode[how.upper()], CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/joint_states", State.__msgtype__, typestore=store)
        for row in range(rows):
            extra = {"seq": row} if old else {}
            frame = "0" * zeros if row == rows - 1 else ""
            header = Header(stamp=Time(1, row * 10_000_000), frame_id=frame, **extra)
            message = State(header, ["joint1"], np.array([0.1 * row]), np.array([1.0]), np.array([2.0 + row]))
            serialised = store.serialize_ros1 if old else store.serialize_cdr
            writer.write(connection, row * 10_000_000 + 1, serialised(message, State.__msgtype__))
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_is_read_whatever_compressed_it(kind, tmp_path):
    read = read_recording(bag(tmp_path, kind), ARM)
    np.testing.assert_allclose(read.q[:, 0], 0.1 * np.arange(12))


@pytest.mark.parametrize("kind", KINDS)
def test_a_chunk_that_unpacks_to_more_than_a_recorder_writes_is_refused(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(unpacking, "MOST", 1_000_000)
    monkeypatch.setattr(unpacking, "HARMLESS", 1_000_000)
    path = bag(tmp_path, kind, zeros=4_000_000)
    with pytest.raises(RecordingError, match=r"x(\.bag)?: its messages would become more than 1 MB: damaged, or made to fill the memory"):
        read_recording(path, ARM)


@pytest.mark.parametrize(("make", "compress", "ratio"), [
    (bz2.BZ2Decompressor, bz2.compress, None), (zstd.ZstdDecompressor, zstd.compress, None), (LZ4FrameDecompressor, lz4_compress, 256),
], ids=["bz2", "zstd", "lz4"])
def test_gigabytes_of_zeros_are_stopped_at_the_limit_in_time_and_memory(make, compress, ratio, monkeypatch):
    assert unpacking.MOST <= 250_000_000
    monkeypatch.setattr(unpacking, "MOST", 50_000_000)
    frame, start = compress(bytes(20_000_000)), time.process_time()
    assert len(unpack(make, frame, ratio)) == 20_000_000
    tracemalloc.start()
    with pytest.raises(RecordingError, match="more than 50 MB"):
        unpack(make, frame * 100, ratio)  # 2 GB
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 200_000_000
    assert time.process_time() - start < 5


@pytest.mark.parametrize(("make", "compress"), [(bz2.BZ2Decompressor, bz2.compress), (zstd.ZstdDecompressor, zstd.compress),
                                                (LZ4FrameDecompressor, lz4_compress)], ids=["bz2", "zstd", "lz4"])
def test_streams_one_after_the_other_are_one_and_a_cut_one_is_refused(make, compress):
    data = np.random.default_rng(1).bytes(5000)
    assert unpack(make, compress(data) + compress(data[::-1])) == data + data[::-1]
    assert unpack(make, compress(b"")) == b""
    with pytest.raises(EOFError, match="cut off"):
        unpack(make, compress(data)[:-20])


def test_what_just_fits_is_unpacked_and_a_byte_more_is_not(monkeypatch):
    monkeypatch.setattr(unpacking, "MOST", 1000)
    assert len(unpack(zstd.ZstdDecompressor, zstd.compress(bytes(1000)))) == 1000
    with pytest.raises(RecordingError, match="made to fill the memory"):
        unpack(zstd.ZstdDecompressor, zstd.compress(bytes(1001)))


def test_a_file_that_is_unpacked_piece_by_piece_stops_at_its_limit():
    with _LimitedFile(io.BytesIO(bytes(100)), 100) as whole:
        assert len(whole.read(60)) == 60
        assert len(whole.read()) == 40
    with _LimitedFile(io.BytesIO(bytes(101)), 100) as more, pytest.raises(RecordingError, match="made to fill the memory"):
        more.read()
