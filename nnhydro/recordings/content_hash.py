"""What a recording holds, as a number: the same for a file that was renamed, moved, re-saved in another format or read through a mapping.

    sha256( "recording" | links | t | q | tau )         t (n,) s, q and tau (n, links) as little-endian float64, row by row

A file that was saved again with fewer digits holds other numbers. It is known by its marks: a few samples, rounded to steps far above the
digits that were lost and far below any noise, hashed twice, the second time with the steps moved by a half, so that one of the two stays
the same where a sample lies between two steps.

Steady tables are known row by row, so that a table with one run more is known but for that run. Masses, filters and derived rates do not
enter: what counts is what was measured.
"""

import hashlib
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.recording import Recording, SteadyTable

Array = NDArray[np.float64]
MARK = "~"  # before a mark, which is no sha256 of a content
SAMPLES = 9
TORQUE, ANGLE = 1e-3, 4e-3  # of the range: steps of the marks; torques carry noise of more than that from run to run
TINY = 1e-12


def _digest(kind: str, *arrays: Array | None) -> str:
    found = hashlib.sha256(kind.encode())
    for array in arrays:
        found.update(b"|none" if array is None else f"|{array.shape}|".encode() + np.ascontiguousarray(array, dtype="<f8").tobytes())
    return found.hexdigest()


def content_sha256(recording: Recording) -> str:
    """Return the sha256 of what `recording` holds: time, angles and torques."""
    return _digest("recording", recording.t, recording.q, recording.tau)


def _ranges(x: Array) -> Array:
    """Return the range of the finite values of every column of `x` (n, k), 0 where there are none."""
    return np.array([np.ptp(column[np.isfinite(column)]) if np.isfinite(column).any() else 0.0 for column in x.T])


def _steps(x: Array, share: float, offset: float) -> NDArray[np.int64]:
    """A few samples of the columns of `x` (n, k) in steps of `share` of their range, which is rounded down to a power of two."""
    some = x[np.round(np.linspace(0, len(x) - 1, SAMPLES)).astype(int)]
    finite = np.where(np.isfinite(some), some, 0.0)
    step = share * 2.0 ** np.floor(np.log2(np.maximum(_ranges(x), TINY)))
    made: NDArray[np.int64] = np.floor((finite - finite[0]) / step + offset).astype(np.int64)
    return made


def marks(recording: Recording) -> frozenset[str]:
    """Return the sha256 of what `recording` holds and the two marks by which it is known when it was saved again with fewer digits."""
    found = {content_sha256(recording)}
    tau = recording.tau
    if len(recording) < SAMPLES or tau is None or not _ranges(tau).any():
        return frozenset(found)  # no torque that differs from run to run: two swings from one angle look alike
    for offset in (0.25, 0.75):
        coarse = [_steps(recording.q, ANGLE, offset), _steps(tau, TORQUE, offset)]
        found.add(MARK + _digest(f"marks|{len(recording)}", *(x.astype(float) for x in coarse))[:32])
    return frozenset(found)


def exact(contents: Iterable[str]) -> frozenset[str]:
    """Return the contents without the marks."""
    return frozenset(content for content in contents if not content.startswith(MARK))


def steady_sha256(table: SteadyTable) -> tuple[str, ...]:
    """Return one sha256 a run of a steady table: its state and its torques."""
    return tuple(_digest("steady", state, tau) for state, tau in zip(table.state, table.tau, strict=True))


def union(*contents: Iterable[str] | None) -> list[str] | None:
    """Return all contents once, sorted; None where one of them is not known."""
    found: set[str] = set()
    for content in contents:
        if content is None:
            return None
        found |= set(content)
    return sorted(found)
