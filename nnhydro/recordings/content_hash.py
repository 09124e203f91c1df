"""What a recording holds, as a number: the same for a file that was renamed, moved, re-saved in another format or read through a mapping.

    sha256( "recording" | links | t | q | tau )         t (n,) s, q and tau (n, links) as little-endian float64, row by row

Steady tables are known row by row, so that a table with one run more is known but for that run. Masses, filters and derived rates do not
enter: what counts is what was measured.
"""

import hashlib
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.recording import Recording, SteadyTable

Array = NDArray[np.float64]


def _digest(kind: str, *arrays: Array | None) -> str:
    found = hashlib.sha256(kind.encode())
    for array in arrays:
        found.update(b"|none" if array is None else f"|{array.shape}|".encode() + np.ascontiguousarray(array, dtype="<f8").tobytes())
    return found.hexdigest()


def content_sha256(recording: Recording) -> str:
    """Return the sha256 of what `recording` holds: time, angles and torques."""
    return _digest("recording", recording.t, recording.q, recording.tau)


def steady_sha256(table: SteadyTable) -> tuple[str, ...]:
    """Return one sha256 a run of a steady table: its state and its torques."""
    return tuple(_digest("steady", state, tau) for state, tau in zip(table.state, table.tau, strict=True))


def union(*contents: Iterable[str] | None) -> list[str] | None:
    """Return all contents once, sorted; None where one of them is not known."""
    found: set[str] = set()
    for one in contents:
        if one is None:
            return None
        found |= set(one)
    return sorted(found)
