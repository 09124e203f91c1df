"""The linear part of a learned model, solved before its networks are trained: penalised least squares, one solution a member.

    minimise  sum over rows and joints of [ (A theta - target) / s_j ]^2  +  sum_p lambda_tier(p) h_p theta_p^2  +  kappa sum_b theta_b^2

A holds the columns of the strips' law and of the body, whose coefficients all joints share, and for each joint the odd features times its
scale and the free functions, all passed through the filter that the torque has passed. h_p is the sum of A_p^2 / s_j^2; what is stated of
the masses (b) keeps its prior instead, one standard deviation being worth kappa. Coefficients lie in tiers, each with a lambda that is
chosen on recordings held out of the fit (tier_choice.py): Morison's two; drag that remembers; memory that swings; inertia that remembers;
each set of surroundings; body and odd features. The free functions, which the mirror need not repeat, are decided first and for
themselves (`beside_the_base`): what is fixed to the tank is no correction of the water's loads, it belongs to the baseline that corrections
fade to. A member solves on the rows that it trains on. One pass over the rows: memory is that of the normal matrices. Source: ridge
regression, Hoerl & Kennard (1970); the tiers are ours.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.features.strip_law import ARM, FREE, SURROUNDED
from nnhydro.fitting.network.linear_columns import Linear
from nnhydro.fitting.network.rows import CHUNK, Rows
from nnhydro.fitting.network.stacking import SHARES, held_out, losses
from nnhydro.fitting.network.tier_choice import CLOSED, PENALTIES, Weights, choice_of_each, usual_weights

FREE_WORTH = 0.9  # of the error left without the free functions
STATED = 1e-3  # kappa: the square of what the model leaves, 2 % of the torque, some three rows being worth one
MOST = 10_000  # watched rows looked at in a choice
FLAT = 1e-12  # of the largest: columns that hardly move are left out


@final
@dataclass(frozen=True, eq=False)
class LinearPart:
    """Coefficients of law and body (E, p), of odd features (E, odd features, joints) and free functions (E, f, joints)."""

    shared: Tensor
    odd: Tensor
    free: Tensor

    def of(self, columns: Tensor) -> Tensor:
        """Return the torques (m, E, joints) N m of `columns` (m, joints, p + odd features)."""
        count = self.shared.shape[1]
        shared, own = columns[..., :count], columns[..., count:]
        return torch.einsum("mjp,ep->mej", shared, self.shared) + torch.einsum("mjp,epj->mej", own, torch.cat([self.odd, self.free], dim=1))

    def free_torque(self, columns: Tensor) -> Tensor:
        """Return those of the free functions alone (m, E, joints) N m."""
        return torch.einsum("mjp,epj->mej", columns[..., self.shared.shape[1] + self.odd.shape[1]:], self.free)


@final
@dataclass
class _Sums:
    """Normal equations: H (q, q) and g (q,)."""

    H: Tensor
    g: Tensor

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

    def without(self, other: "_Sums") -> "_Sums":
        """Return the sums over the rows that are not in `other`."""
        return _Sums(self.H - other.H, self.g - other.g)


def _sums(rows: Rows, columns: Tensor, shared: int, watch: Tensor) -> tuple[_Sums, list[_Sums]]:
    """Sums over all rows, and over those that each member watches; `watch` (E, n) bool. Rows that the same members watch go together."""
    s = rows.target.double().pow(2).mean(dim=0).sqrt() + 1e-9
    q = shared + (columns.shape[2] - shared) * columns.shape[1]
    who, which = torch.unique(watch, dim=1, return_inverse=True)  # (E, sets of members), (n,)
    everything, watched = _Sums.zero(q), [_Sums.zero(q) for _ in watch]
    for number, members in enumerate(who.T):
        together, rows_of = _Sums.zero(q), (which == number).nonzero().ravel()
        for part in torch.split(rows_of, CHUNK):
            A, z = columns[part].double() / s[:, None], rows.target[part].double() / s
            together.add(A[..., :shared], A[..., shared:], z)
        for sums in (everything, *(sums for sums, mine in zip(watched, members, strict=True) if mine)):
            sums.H += together.H
            sums.g += together.g
    return everything, watched


def _solve(A: Tensor, b: Tensor, shared: int, joints: int) -> Tensor:
    """Return A^-1 b (q,); the odd features of two joints share no rows, so that each joint's block is eliminated for itself."""
    top, right, blocks = A[:shared, :shared], b[:shared], []
    for odd in torch.arange(shared, len(b)).chunk(joints) if len(b) > shared else ():
        o = slice(int(odd[0]), int(odd[-1]) + 1)
        root = torch.linalg.cholesky(A[o, o])
        blocks.append(torch.cholesky_solve(torch.cat([A[o, :shared], b[o, None]], dim=1), root))
        top, right = top - A[:shared, o] @ blocks[-1][:, :-1], right - A[:shared, o] @ blocks[-1][:, -1]
    first = torch.linalg.solve(top, right)
    return torch.cat([first, *(block[:, -1] - block[:, :-1] @ first for block in blocks)])


Solution = Callable[[Weights], Tensor]  # theta (q,)


def _solutions(sums: _Sums, size: Tensor, stated: slice, tier: Tensor, shared: int, joints: int) -> Solution:
    """Return theta (q,) of one member; `size` (q,) is h, `stated` the coefficients with a prior, `tier` (q,) that of each."""
    there = torch.diagonal(sums.H) > FLAT * size.max()
    unit = torch.where(there, 1 / size.clamp(min=1e-300).sqrt(), torch.zeros_like(size))
    known = torch.zeros_like(size)
    known[stated] = STATED * unit[stated] ** 2
    usual = torch.ones_like(size)
    usual[stated] = 0.0
    A, b = unit[:, None] * sums.H * unit + torch.diag(known), unit * sums.g

    def theta(weights: Weights) -> Tensor:
        """Return the parameters (p,) at the penalties `weights`, one a tier."""
        weight = torch.tensor(weights, dtype=torch.float64)[tier]
        open_ = ((weight < CLOSED) | (usual == 0)).nonzero().ravel()
        own = A.index_select(0, open_).index_select(1, open_)
        own.diagonal().add_(weight[open_] * usual[open_] + 1e-12)
        found = torch.zeros_like(b)
        found[open_] = unit[open_] * _solve(own, b[open_], int((open_ < shared).sum()), joints)
        return found

    return theta


def _part(theta: Tensor, linear: Linear, joints: int) -> LinearPart:
    own = theta[:, linear.shared:].reshape(len(theta), joints, -1).transpose(1, 2)
    odd = own.shape[1] - linear.free_size
    return LinearPart(theta[:, :linear.shared], own[:, :odd], own[:, odd:])


def _losses_on_watched(rows: Rows, columns: Tensor, watched: Tensor, fades: bool) -> Callable[[LinearPart], Tensor]:
    """The losses (shares, recordings, joints) of a linear part on MOST rows, evenly spaced, that its members watch (stacking.py)."""
    index = watched.any(dim=0)[rows.unit].nonzero().ravel()
    index = index[::len(index) // MOST + 1]
    A, scale = (x[index].double() for x in (columns, rows.scale))
    unit, shares, left_out = rows.unit[index], SHARES if fades else (1.0,), float(watched.double().mean())
    mine = watched[:, unit]
    target = rows.target_of(index, mine)
    return lambda part: losses(target, held_out(part.of(A).transpose(0, 1), mine, scale, left_out if fades else None), unit, shares)


def left_over(rows: Rows, part: LinearPart, columns: Tensor, watched: Tensor, s: Tensor) -> float:
    """Return the mean over joints and watched rows of |target - linear| / s, `part` and `watched` (E, units) those of each member."""
    total, count = 0.0, 0
    for start in range(0, len(rows.target), CHUNK):
        piece = slice(start, start + CHUNK)
        mine = watched[:, rows.unit[piece]].T  # (m, E)
        off = (rows.target[piece, None].double() - part.of(columns[piece].double())).abs() / s
        total += float(off[mine].sum())
        count += int(mine.sum()) * off.shape[2]
    return total / max(count, 1)


@final
@dataclass(frozen=True, eq=False)
class _Members:
    """The normal equations of every member, and of all rows together."""

    each: list[Solution]
    whole: Solution
    tier: Tensor  # (q,)
    linear: Linear
    joints: int

    @staticmethod
    def of(rows: Rows, linear: Linear, watched: Tensor, stated: int) -> "_Members":
        """Return the sums of all members over the rows that each has watched."""
        shared, joints = linear.shared, rows.target.shape[1]
        prior = slice(linear.law_size, linear.law_size + stated)
        everything, seen = _sums(rows, linear.columns, shared, watched[:, rows.unit])
        size = torch.diagonal(everything.H)
        tier = torch.full_like(size, ARM).long()
        tier[:linear.law_size] = linear.tiers
        for own in torch.arange(shared, len(size)).chunk(joints) if linear.free_size else ():
            tier[own[-linear.free_size:]] = FREE
        solutions = [_solutions(sums, size, prior, tier, shared, joints) for sums in (everything, *(everything.without(x) for x in seen))]
        return _Members(solutions[1:], solutions[0], tier, linear, joints)

    @property
    def tiers(self) -> int:
        """How many tiers there may be."""
        return max(int(self.tier.max()) + 1, SURROUNDED)

    def _theta(self, weights: Sequence[Weights]) -> Tensor:
        return torch.stack([solution(own) for solution, own in zip(self.each, weights, strict=True)])

    def unseen(self, weights: Sequence[Weights]) -> LinearPart:
        """Return what each member, with its weights, makes of the rows that it trains on."""
        return _part(self._theta(weights), self.linear, self.joints)

    def in_use(self, weights: Sequence[Weights]) -> LinearPart:
        """Return the same, moved so that the mean is that of all rows."""
        theta, whole = self._theta(weights), torch.stack([self.whole(own) for own in weights])
        return _part(theta + (whole - theta).mean(dim=0), self.linear, self.joints)


def linear_part(rows: Rows, linear: Linear, watched: Tensor, stated: int, fades: bool = False) -> tuple[LinearPart, LinearPart]:
    """Return the linear part of every member, twice: of the rows that it trains on alone, and moved so that the mean is that of all rows.

    The first tells what a member makes of recordings that it has not seen, the second is for use; members differ alike in both. `watched`
    (E, units) bool says which units a member leaves out; arm.yaml states the first `stated` coefficients of the body to be 0 +- 1. `fades`
    says whether there is a baseline to fade to. Free functions stay closed.
    """
    members = _Members.of(rows, linear, watched, stated)
    count, chosen = len(watched), [usual_weights(members.tiers)] * len(watched)
    if bool(watched[:, rows.unit].any()):
        left = _losses_on_watched(rows, linear.columns, watched, fades)
        chosen = choice_of_each(lambda weights: left(members.unseen([weights] * count)), set(members.tier.tolist()), members.tiers, count)
    return members.unseen(chosen), members.in_use(chosen)


def beside_the_base(rows: Rows, linear: Linear, watched: Tensor, stated: int, s: Tensor) -> tuple[LinearPart, LinearPart] | None:
    """Return the linear part with its free functions, twice as `linear_part` does; None where held-out recordings do not ask for them.

    They are judged by what is left of the torque, pooled over the recordings that members watch, in units of s (joints,) N m: a baseline
    that knows nothing of a line tells nothing of how far to trust it.
    """
    if not linear.free_size or not bool(watched[:, rows.unit].any()):
        return None
    members = _Members.of(rows, linear, watched, stated)

    def weights(free: float) -> list[Weights]:
        """Return the weights of each member for one of the free functions."""
        usual = usual_weights(members.tiers)
        return [(*usual[:FREE], free, *usual[FREE + 1:])] * len(watched)

    def misfit(free: float) -> float:
        return left_over(rows, members.unseen(weights(free)), linear.columns, watched, s)

    found = {free: misfit(free) for free in PENALTIES}
    best = min(found, key=found.__getitem__)
    return (members.unseen(weights(best)), members.in_use(weights(best))) if found[best] < FREE_WORTH * misfit(CLOSED) else None
