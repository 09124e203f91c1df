"""How much the library rosbags may unpack: by itself it takes a chunk whole, and a few kilobytes can become gigabytes.

Its tables of decompressors are filled with ones that stop at MOST, once and for all readers of this process. A recorder's chunks hold 1 to
10 MB; a ROS 2 bag that is compressed file by file is unpacked to a temporary file, which may be fifty times as large as the bag.
"""

import bz2
from collections.abc import Callable
from functools import cache
from types import SimpleNamespace, TracebackType
from typing import Any

from nnhydro.errors import RecordingError
from nnhydro.recordings.readers.table import HARMLESS, MAX_RATIO

MOST = 200_000_000  # bytes that one chunk may hold
LZ4_RATIO = 256  # bytes that one byte of an LZ4 block can become


def _too_much(most: int) -> RecordingError:
    return RecordingError(f"its messages would become more than {most / 1e6:.0f} MB: damaged, or made to fill the memory; "
                          "record it again with smaller chunks, or export its joint states to CSV")


def unpack(make: Callable[[], Any], data: bytes, ratio: int | None = None) -> bytes:
    """Return what `data` holds, one compressed stream after the other, by decompressors that `make` makes.

    Raises RecordingError beyond MOST bytes, EOFError where a stream is cut off.
    """
    parts: list[bytes] = []
    left = MOST
    while data:
        decompressor = make()
        room = left + 1 if ratio is None else min(left + 1, ratio * len(data) + 1)  # lz4 takes all the room that it is given
        parts.append(decompressor.decompress(data, max_length=room))
        left -= len(parts[-1])
        if left < 0:
            raise _too_much(MOST)
        if not decompressor.eof:
            raise EOFError("a chunk is cut off")
        data = decompressor.unused_data or b""
    return b"".join(parts)


class _LimitedFile:
    """A compressed file that is read as such, and no further than is plausible."""

    def __init__(self, inner: Any, most: int) -> None:
        self._inner, self._left, self._most = inner, most, most

    def __enter__(self) -> "_LimitedFile":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._inner.close()

    def read(self, size: int = -1) -> bytes:
        """Return the next bytes."""
        piece: bytes = self._inner.read(size)
        self._left -= len(piece)
        if self._left < 0:
            raise _too_much(self._most)
        return piece


@cache
def limit_rosbags() -> None:
    """Let rosbags unpack through these functions."""
    from lz4.frame import LZ4FrameDecompressor
    from rosbags.rosbag1 import reader as ros1
    from rosbags.rosbag2 import reader as ros2
    from rosbags.rosbag2 import storage_mcap

    zstd = vars(ros2)["zstd"]  # compression.zstd, or what stands for it before Python 3.14

    def lz4(data: bytes, size: int = 0) -> bytes:
        return unpack(LZ4FrameDecompressor, data, LZ4_RATIO)

    def zstandard(data: bytes, size: int = 0) -> bytes:
        return unpack(zstd.ZstdDecompressor, data)

    def open_limited(file: Any, mode: str = "rb") -> _LimitedFile:
        """Return the open file, which stops where it unpacks to more than it may."""
        file.seek(0, 2)
        most = max(HARMLESS, MAX_RATIO * file.tell())
        file.seek(0)
        return _LimitedFile(zstd.open(file, mode), most)

    ros1.decompressors |= {"bz2": lambda data: unpack(bz2.BZ2Decompressor, data), "lz4": lz4}
    storage_mcap.DECOMPRESSORS |= {"lz4": lz4, "zstd": zstandard}
    vars(ros2)["zstd"] = SimpleNamespace(decompress=zstandard, open=open_limited)
