"""Sufficient statistics of the diagnosis: Gram matrices of baseline columns, candidate columns and torque, a block and joint.

    G_bj = sum over rows of block b of [Y X y]' [Y X y]         Y (n, p) baseline, X (n, K) candidates, y (n,) torque of joint j

A block is part of a recording (or a group of steady runs); all fits, scores, left-out errors and bootstraps are small algebra on the sums.
Rows are thinned to about two a period of the comparison's cut-off, where low-passed noise is nearly white.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
ROWS_PER_CUTOFF = 2.5  # rows kept a period of the cut-off
PARTS = 4  # blocks a recording


@final
@dataclass(frozen=True, eq=False)
class Blocks:
    """Gram matrices `G` (blocks, joints, P, P) with P = p + K + 1 (torque last), rows `n` (blocks,), unit number `unit` (blocks,)."""

    G: Array
    n: Array
    unit: NDArray[np.int64]
    p: int

    @property
    def K(self) -> int:
        """Number of candidate columns."""
        return int(self.G.shape[2]) - self.p - 1

    def by_unit(self) -> tuple[Array, Array]:
        """Return the sums (units, joints, P, P) and rows (units,) a unit."""
        units = int(self.unit.max()) + 1
        G = np.zeros((units, *self.G.shape[1:]))
        for unit, block in zip(self.unit, self.G, strict=True):  # several times as fast as np.add.at
            G[unit] += block
        return G, np.bincount(self.unit, self.n, minlength=units).astype(float)


def kept_rows(segment: Segment) -> NDArray[np.int64]:
    """Return the rows of a segment that count: compared, and thinned to nearly independent noise."""
    low_pass = segment.low_pass
    stride = 1 if low_pass is None else max(1, int(1 / (ROWS_PER_CUTOFF * low_pass.cutoff_hz * segment.dt)))
    rows: NDArray[np.int64] = np.flatnonzero(segment.keep)[::stride]
    return rows


def parts_of(rows: int, parts: int) -> list[slice]:
    """Return the consecutive blocks of so many rows: at most `parts`, of at least 8 rows."""
    count = min(parts, max(rows // 8, 1))
    ends = np.cumsum([len(piece) for piece in np.array_split(np.arange(rows), count)]).tolist()
    return [slice(start, end) for start, end in zip([0, *ends], ends, strict=False)]


def block_grams(table: Array, parts: int) -> tuple[Array, Array]:
    """Return G (parts, joints, P, P) and rows (parts,) of consecutive parts of `table` (n, joints, P)."""
    pieces = [table[part] for part in parts_of(len(table), parts)]
    G: Array = np.stack([np.matmul(piece.transpose(1, 2, 0), piece.transpose(1, 0, 2)) for piece in pieces])
    return G, np.array([len(piece) for piece in pieces], dtype=float)
