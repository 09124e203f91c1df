"""The linear part of a learned model, solved before its networks are trained: penalised least squares, one solution a member.

    minimise  sum over rows and joints of [ (A theta - target) / s_j ]^2  +  lambda sum_p h_p theta_p^2  +  kappa sum_b theta_b^2

A holds the columns of the strips' law and of the body, whose coefficients all joints share, and for each joint the odd features times its
scale, all passed through the filter that the torque has passed. h_p is the sum of A_p^2 / s_j^2; what is stated of the masses (b) keeps its
prior instead, one standard deviation being worth kappa. A member solves on the rows that it trains on; lambda is the one with which all
members together do best on the recordings that they watch. One pass over the rows: memory is that of the normal matrices.
Source: ridge regression; the rest is ours.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.identification.linear_columns import Linear
from nnhydro.identification.training_rows import CHUNK, Rows

PENALTIES = tuple(10.0 ** (-k / 2) for k in range(1, 15))  # lambda
UNWATCHED = 1e-3  # where no recording can be watched
STATED = 1e-3  # kappa: the square of what the model leaves, 2 % of the torque, some three rows being worth one
FLAT = 1e-12  # of the largest: columns that hardly move are left out


@final
@dataclass(frozen=True, eq=False)
class LinearPart:
    """Coefficients of law and body (E, p) and of the odd features (E, odd features, joints) as they are, not standardised."""

    shared: Tensor
    odd: Tensor

    def of(self, columns: Tensor) -> Tensor:
        """Return the torques (m, E, joints) N m of `columns` (m, joints, p + odd features)."""
        count = self.shared.shape[1]
        shared, odd = columns[..., :count], columns[..., count:]
        return torch.einsum("mjp,ep->mej", shared, self.shared) + torch.einsum("mjp,epj->mej", odd, self.odd)


@final
@dataclass
class _Sums:
    """Normal equations: H (q, q), g (q,), the squares c, and the number of rows."""

    H: Tensor
    g: Tensor
    c: float = 0.0
    n: int = 0

    @staticmethod
    def zero(q: int) -> "_Sums":
        return _Sums(torch.zeros(q, q, dtype=torch.float64), torch.zeros(q, dtype=torch.float64))

    def add(self, shared: Tensor, odd: Tensor, z: Tensor) -> None:
        """Add rows of weighted columns, shared (m, joints, p) and odd (m, joints, k), with right-hand sides z (m, joints)."""
        p, k = shared.shape[2], odd.shape[2]
        for j in range(z.shape[1]):
            place = torch.cat([torch.arange(p), torch.arange(p + j * k, p + (j + 1) * k)])
            A = torch.cat([shared[:, j], odd[:, j]], dim=1)
            self.H[place[:, None], place] += A.T @ A
            self.g[place] += A.T @ z[:, j]
        self.c += float((z**2).sum())
        self.n += len(z)

    def without(self, other: "_Sums") -> "_Sums":
        """Return the sums over the rows that are not in `other`."""
        return _Sums(self.H - other.H, self.g - other.g, self.c - other.c, self.n - other.n)

    def error(self, theta: Tensor) -> float:
        """Sum of squares that theta (q,) leaves over these rows."""
        return float(self.c - 2 * self.g @ theta + theta @ self.H @ theta)


def _sums(rows: Rows, columns: Tensor, shared: int, watch: Tensor) -> tuple[_Sums, list[_Sums]]:
    """Sums over all rows, and over those that each member watches; `watch` (E, n) bool."""
    s = rows.target.double().pow(2).mean(dim=0).sqrt() + 1e-9
    q = shared + (columns.shape[2] - shared) * columns.shape[1]
    everything, watched = _Sums.zero(q), [_Sums.zero(q) for _ in watch]
    for start in range(0, len(columns), CHUNK):
        part = slice(start, start + CHUNK)
        A, z = columns[part].double() / s[:, None], rows.target[part].double() / s
        everything.add(A[..., :shared], A[..., shared:], z)
        for sums, mask in zip(watched, watch[:, part], strict=True):
            sums.add(A[mask][..., :shared], A[mask][..., shared:], z[mask])
    return everything, watched


def _solved(A: Tensor, b: Tensor, shared: int, joints: int) -> Tensor:
    """Return A^-1 b (q,); the odd features of two joints share no rows, so that each joint's block is eliminated for itself."""
    top, right, blocks = A[:shared, :shared], b[:shared], []
    for odd in torch.arange(shared, len(b)).chunk(joints) if len(b) > shared else ():
        o = slice(int(odd[0]), int(odd[-1]) + 1)
        root = torch.linalg.cholesky(A[o, o])
        blocks.append(torch.cholesky_solve(torch.cat([A[o, :shared], b[o, None]], dim=1), root))
        top, right = top - A[:shared, o] @ blocks[-1][:, :-1], right - A[:shared, o] @ blocks[-1][:, -1]
    first = torch.linalg.solve(top, right)
    return torch.cat([first, *(block[:, -1] - block[:, :-1] @ first for block in blocks)])


def _solutions(sums: _Sums, size: Tensor, stated: slice, shared: int, joints: int) -> Callable[[float], Tensor]:
    """Return the function lambda -> theta (q,) of one member; `size` (q,) is h, `stated` the coefficients with a prior of their own."""
    there = torch.diagonal(sums.H) > FLAT * size.max()
    unit = torch.where(there, 1 / size.clamp(min=1e-300).sqrt(), torch.zeros_like(size))
    known = torch.zeros_like(size)
    known[stated] = STATED * unit[stated] ** 2
    free = torch.ones_like(size)
    free[stated] = 0.0
    A, b = unit[:, None] * sums.H * unit + torch.diag(known), unit * sums.g

    def theta(penalty: float) -> Tensor:
        return unit * _solved(A + torch.diag(penalty * free + 1e-12), b, shared, joints)

    return theta


def _part(theta: Tensor, shared: int, joints: int) -> LinearPart:
    return LinearPart(theta[:, :shared], theta[:, shared:].reshape(len(theta), joints, -1).transpose(1, 2))


def linear_part(rows: Rows, linear: Linear, watched: Tensor, stated: int) -> tuple[LinearPart, LinearPart]:
    """Return the linear part of every member, twice: of the rows that it trains on alone, and moved so that the mean is that of all rows.

    The first tells what a member makes of recordings that it has not seen, the second is for use; members differ alike in both. `watched`
    (E, units) bool says which units a member leaves out; arm.yaml states the first `stated` coefficients of the body to be 0 +- 1.
    """
    shared, joints = linear.columns.shape[2] - int((rows.parity < 0).sum()), rows.target.shape[1]
    prior = slice(linear.law_size, linear.law_size + stated)
    everything, seen = _sums(rows, linear.columns, shared, watched[:, rows.unit])
    size = torch.diagonal(everything.H)
    members = [_solutions(everything.without(own), size, prior, shared, joints) for own in seen]

    def left(penalty: float) -> float:
        return sum(own.error(solution(penalty)) for own, solution in zip(seen, members, strict=True))

    best = min(PENALTIES, key=left) if any(own.n for own in seen) else UNWATCHED
    theta = torch.stack([solution(best) for solution in members])
    shown = _solutions(everything, size, prior, shared, joints)(best)
    moved = theta + (shown - theta.mean(dim=0))
    return _part(theta, shared, joints), _part(moved, shared, joints)
