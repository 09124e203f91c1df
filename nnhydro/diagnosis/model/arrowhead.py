"""The Cholesky factor of an arrowhead matrix: diagonal blocks that only a border couples.

    M = [[A_1, 0, B_1], [0, A_2, B_2], [B_1', B_2', C]] = L L',   A_i = L_i L_i',   W_i = L_i^-1 B_i,   C - sum_i W_i'W_i = L_0 L_0'

The unknown of one joint meets that of another only through baseline and columns. Source: Golub & Van Loan (2013), section 4.2.9 (block
Cholesky).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Arrowhead:
    """The factor: `blocks` L_i (m_i, m_i) and `corner` L_0 (r, r), lower triangles, with `borders` W_i (m_i, r)."""

    blocks: Sequence[Array]
    borders: Sequence[Array]
    corner: Array

    @staticmethod
    def of(blocks: Sequence[Array], borders: Sequence[Array], corner: Array) -> "Arrowhead":
        """Return the factor of M by its blocks A_i, B_i and C; A_i and C are used up. Raises LinAlgError where M is not positive."""
        factors = [_cholesky(A) for A in blocks]
        reduced = [_solve(L, B) for L, B in zip(factors, borders, strict=True)]
        for W in reduced:
            corner -= W.T @ W
        return Arrowhead(factors, reduced, _cholesky(corner))

    def _parts(self, b: Array) -> list[Array]:
        """Return the rows of `b` block by block, those of the corner last."""
        ends = accumulate((len(L) for L in (*self.blocks, self.corner)), initial=0)
        return [b[start:stop] for start, stop in pairwise(ends)]

    def forward(self, b: Array) -> Array:
        """Return L^-1 b of `b` (l, ...)."""
        *outer, inner = self._parts(b)
        solved = [_solve(L, part) for L, part in zip(self.blocks, outer, strict=True)]
        for W, x in zip(self.borders, solved, strict=True):
            inner = inner - W.T @ x
        return np.concatenate([*solved, _solve(self.corner, inner)])

    def backward(self, b: Array) -> Array:
        """Return L'^-1 b of `b` (l, ...)."""
        *outer, inner = self._parts(b)
        x = _solve(self.corner, inner, transposed=True)
        return np.concatenate([*(_solve(L, part - W @ x, transposed=True)
                                 for L, W, part in zip(self.blocks, self.borders, outer, strict=True)), x])

    def log_determinant(self) -> float:
        """Return log |M|."""
        return 2.0 * sum(float(np.log(np.diag(L)).sum()) for L in (*self.blocks, self.corner))

    def inverse_diagonal(self) -> Array:
        """Return the diagonal (l,) of M^-1: the sums of squares of the columns of L^-1."""
        inner = _inverse(self.corner)
        made = []
        for L, W in zip(self.blocks, self.borders, strict=True):
            outer = _inverse(L)
            made.append((outer**2).sum(axis=0) + (((inner @ W.T) @ outer) ** 2).sum(axis=0))
        return np.concatenate([*made, (inner**2).sum(axis=0)])


def _cholesky(A: Array) -> Array:
    from scipy.linalg.lapack import dpotrf

    if not A.size:
        return A
    L, info = dpotrf(A.T, lower=1, overwrite_a=1)
    if info:
        raise np.linalg.LinAlgError(f"row {info} of M is not positive")
    made: Array = L
    return made


def _solve(L: Array, b: Array, transposed: bool = False) -> Array:
    from scipy.linalg.lapack import dtrtrs

    made: Array = dtrtrs(L, b, lower=1, trans=int(transposed))[0] if b.size else b
    return made


def _inverse(L: Array) -> Array:
    from scipy.linalg.lapack import dtrtri

    made: Array = dtrtri(L, lower=1)[0] if L.size else L
    return made
