"""Normal equations of the linear part: sums over rows that serve any target, and the solutions of many penalties at a time.

    H_e = sum_j G_ej / s_j^2,    G_ej = sum of A_j' A_j over the rows that member e trains on,    [H_e + diag(lambda_tier h)] theta = g_e

The columns A do not know the target, so G is summed once however many baselines are compared. Where the penalties of one tier alone are
varied, all other coefficients are eliminated once for all of them (Schur complement): what remains has the size of that tier.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import torch
from scipy.linalg.blas import dsyrk
from torch import Tensor

Weights = tuple[float, ...]  # lambda of each tier

CLOSED = 1e9  # lambda that leaves a tier out
CHUNK = 8192  # rows worked on at a time
STATED = 1e-3  # kappa: the square of what the model leaves, 2 % of the torque, some three rows being worth one
FLAT = 1e-12  # of the largest: columns that hardly move are left out


def _gram(columns: Tensor) -> Tensor:
    """A' A (joints, p, p) of `columns` (n, joints, p), in double precision."""
    found = torch.zeros(columns.shape[1], columns.shape[2], columns.shape[2], dtype=torch.float64)
    for j, total in enumerate(found):
        for part in torch.split(columns[:, j], CHUNK):
            total += torch.from_numpy(dsyrk(1.0, part.double().numpy().T))
        total += total.triu(1).T
    return found


@final
@dataclass(frozen=True, eq=False)
class Grams:
    """A_j' A_j over all rows, `whole` (joints, p, p), and over those that each member watches, `seen` (E, joints, p, p)."""

    whole: Tensor
    seen: Tensor

    @staticmethod
    def of(columns: Tensor, watch: Tensor) -> "Grams":
        """Return the sums of `columns` (n, joints, p); `watch` (E, n) bool. Rows that the same members watch go together."""
        who, which = torch.unique(watch, dim=1, return_inverse=True)  # (E, sets of members), (n,)
        whole = torch.zeros(columns.shape[1], columns.shape[2], columns.shape[2], dtype=torch.float64)
        seen = whole.repeat(len(watch), 1, 1, 1)
        for number, members in enumerate(who.T):
            together = _gram(columns[which == number])
            whole += together
            seen[members] += together
        return Grams(whole, seen)

    def first(self, count: int) -> "Grams":
        """Return the sums of the first `count` columns."""
        return Grams(self.whole[:, :count, :count], self.seen[:, :, :count, :count])

    def hessians(self, s: Tensor, shared: int) -> tuple[Tensor, Tensor]:
        """Return H (q, q) over all rows and (E, q, q) over those that each member trains on, a joint in units of s (joints,) N m.

        The first `shared` columns have one coefficient for all joints, the others one per joint: q = shared + joints times their number.
        """
        joints, per_joint = len(s), self.whole.shape[1] - shared
        H = torch.zeros(1 + len(self.seen), shared + joints * per_joint, shared + joints * per_joint, dtype=torch.float64)
        for j in range(joints):
            G = torch.cat([self.whole[None, j], self.whole[j] - self.seen[:, j]]) / s[j] ** 2
            o = slice(shared + j * per_joint, shared + (j + 1) * per_joint)
            H[:, :shared, :shared] += G[:, :shared, :shared]
            H[:, :shared, o], H[:, o, :shared], H[:, o, o] = G[:, :shared, shared:], G[:, shared:, :shared], G[:, shared:, shared:]
        return H[0], H[1:]


def right_hand_sides(columns: Tensor, shared: int, target: Tensor, watch: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Return s (joints,) N m, the rms of `target` (n, joints), and g = A' target / s^2 of all rows (q,) and of each member's own (E, q)."""
    s = target.double().pow(2).mean(dim=0).sqrt() + 1e-9
    sums = torch.zeros(target.shape[1], columns.shape[2], 1 + len(watch), dtype=torch.float64)
    for A, z, seen in zip(*(torch.split(x, CHUNK) for x in (columns, target, watch.T)), strict=True):
        counted = torch.cat([torch.ones(len(z), 1, dtype=torch.bool), ~seen], dim=1)
        for j, total in enumerate(sums):
            total += A[:, j].double().T @ (z[:, j, None].double() * counted)
    sums = sums / (s**2)[:, None, None]
    g = torch.cat([sums[:, :shared].sum(dim=0), sums[:, shared:].flatten(0, 1)]).T
    return s, g[0], g[1:]


@final
@dataclass(frozen=True, eq=False)
class Ridge:
    """Penalised problems of M members: A (M, q, q) and b (M, q) in units of `unit` (M, q), the size of a column.

    `usual` (q,) is 0 for coefficients with a prior of their own, else 1. All of these lie tier by tier, the coefficient `order` (q,) first;
    `tier` (q,) is that of each coefficient as it was given.
    """

    A: Tensor
    b: Tensor
    unit: Tensor
    usual: Tensor
    tier: Tensor
    order: Tensor

    @staticmethod
    def of(H: Tensor, g: Tensor, size: Tensor, stated: slice, tier: Tensor) -> "Ridge":
        """Return the problems of H (M, q, q) and g (M, q); `size` (q,) is h, `stated` are the coefficients with a prior."""
        there = torch.diagonal(H, dim1=1, dim2=2) > FLAT * size.max()
        unit = torch.where(there, 1 / size.clamp(min=1e-300).sqrt(), torch.zeros_like(size))
        usual = torch.ones_like(size)
        usual[stated] = 0.0
        A = unit[:, :, None] * H * unit[:, None]
        torch.diagonal(A, dim1=1, dim2=2)[:, stated] += STATED * unit[:, stated] ** 2
        order = torch.argsort(2 * tier + usual.long(), stable=True)
        return Ridge(A[:, order[:, None], order], (unit * g)[:, order], unit[:, order], usual[order], tier, order)

    def of_member(self, member: int) -> "Ridge":
        """Return the problem of one member alone."""
        at = slice(member, member + 1)
        return Ridge(self.A[at], self.b[at], self.unit[at], self.usual, self.tier, self.order)

    def theta(self, several: Sequence[Weights]) -> Tensor:
        """Return the coefficients (len(several), M, q) at several penalties, one a tier, that close the same tiers."""
        weight = torch.tensor(several, dtype=torch.float64)[:, self.tier[self.order]]
        varied = (weight != weight[0]).any(dim=0) & (self.usual > 0)
        closed = (weight[0] >= CLOSED) & (self.usual > 0)
        fixed, moved = ((of & ~closed).nonzero().ravel() for of in (~varied, varied))
        weight = weight * self.usual + 1e-12
        found = torch.zeros(len(several), *self.b.shape, dtype=torch.float64)
        place = self.order
        found[..., place[fixed]], found[..., place[moved]] = (
            self.unit[:, of] * part for of, part in zip((fixed, moved), self._solution(fixed, moved, weight[0, fixed], weight[:, moved]),
                                                          strict=True))
        return found

    def _solution(self, fixed: Tensor, moved: Tensor, weight: Tensor, weights: Tensor) -> tuple[Tensor, Tensor]:
        """The coefficients `fixed` (k,), whose penalties are one `weight` (k,), and `moved` (m,), with `weights` (several, m)."""
        k, m = _runs(fixed), _runs(moved)
        root = torch.linalg.cholesky(_part(self.A, k, k) + torch.diag(weight))
        right = torch.cat([_part(self.A, k, m), self.b[:, fixed, None]], dim=2)
        half = torch.linalg.solve_triangular(root, right, upper=False)
        across, load = half[..., :-1], half[..., -1:]
        rest = _part(self.A, m, m) - across.mT @ across
        factor = torch.linalg.cholesky(rest + torch.diag_embed(weights)[:, None])
        u = torch.cholesky_solve(self.b[:, moved, None] - across.mT @ load, factor)
        side_by_side = u[..., 0].permute(1, 2, 0)  # (M, m, several): else `root` is copied for each of the several
        v = torch.linalg.solve_triangular(root.mT, load - across @ side_by_side, upper=True)
        return v.permute(2, 0, 1), u[..., 0]


def _runs(index: Tensor) -> list[slice]:
    """The neighbours among the ascending numbers `index`: tiers lie together, and copying whole runs takes a tenth of the time."""
    parts = torch.tensor_split(index, (index.diff() != 1).nonzero().ravel() + 1)
    return [slice(int(part[0]), int(part[-1]) + 1) for part in parts if len(part)]


def _part(A: Tensor, rows: Sequence[slice], columns: Sequence[slice]) -> Tensor:
    """The part of A (M, q, q) in the runs `rows` and `columns`."""
    made = A.new_empty(len(A), sum(r.stop - r.start for r in rows), sum(c.stop - c.start for c in columns))
    i = 0
    for r in rows:
        j = 0
        for c in columns:
            made[:, i:i + r.stop - r.start, j:j + c.stop - c.start] = A[:, r, c]
            j += c.stop - c.start
        i += r.stop - r.start
    return made
