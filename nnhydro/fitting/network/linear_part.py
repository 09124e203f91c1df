"""The linear part of a learned model, solved before its networks are trained: penalised least squares, one solution a member.

    minimise  sum over rows and joints of [ (A theta - target) / s_j ]^2  +  sum_p lambda_tier(p) h_p theta_p^2  +  kappa sum_b theta_b^2

A holds the columns of the strips' law and of the body, whose coefficients all joints share, and for each joint the odd features times its
scale and the free functions, all passed through the filter that the torque has passed. h_p is the sum of A_p^2 / s_j^2; what is stated of
the masses (b) keeps its prior instead, one standard deviation being worth kappa. Coefficients lie in tiers, each with a lambda that is
chosen on recordings held out of the fit (tier_choice.py): Morison's two; drag that remembers; memory that swings; inertia that remembers;
each set of surroundings; body and odd features. The free functions, which the mirror need not repeat, are decided first and for
themselves (`with_free_functions`). What is fixed to the tank is no correction of the water's loads: it belongs to the baseline that
corrections fade to. A member solves on the rows that it trains on. One pass over the rows: memory is that of the normal matrices.
Source: ridge regression, Hoerl & Kennard (1970); the tiers are ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.features.strip_law.law import ARM, FREE, SURROUNDED
from nnhydro.fitting.linear.normal_equations import Grams, Ridge, Weights, right_hand_sides
from nnhydro.fitting.network.linear_columns import Linear
from nnhydro.fitting.network.rows import CHUNK, Rows
from nnhydro.fitting.network.tier_choice import PENALTIES, JudgedRows, choice_of_each, usual_weights

FREE_WORTH = 0.9  # of the error left without the free functions


@final
@dataclass(frozen=True, eq=False)
class LinearPart:
    """Coefficients of law and body (E, p), of odd features (E, odd features, joints) and free functions (E, f, joints)."""

    shared: Tensor
    odd: Tensor
    free: Tensor

    def of(self, columns: Tensor) -> Tensor:
        """Return the torques (m, E, joints) N m of `columns` (m, joints, p + odd features)."""
        per_joint = torch.cat([self.odd, self.free], dim=1)
        return torch.stack([columns[:, j] @ torch.cat([self.shared, per_joint[..., j]], dim=1).T for j in range(columns.shape[1])], dim=2)

    def free_torque(self, columns: Tensor) -> Tensor:
        """Return those of the free functions alone (m, E, joints) N m."""
        return torch.einsum("mjp,epj->mej", columns[..., self.shared.shape[1] + self.odd.shape[1]:], self.free)


def left_over(rows: Rows, parts: Sequence[LinearPart], columns: Tensor, watched: Tensor, s: Tensor) -> list[float]:
    """Return for each of `parts` the mean over joints and watched rows of |target - linear| / s, `watched` (E, units) by its members."""
    every = LinearPart(*(torch.cat([getattr(part, name) for part in parts]) for name in ("shared", "odd", "free")))
    total, count = torch.zeros(len(parts), dtype=torch.float64), 0
    for start in range(0, len(rows.target), CHUNK):
        piece = slice(start, start + CHUNK)
        mine = watched[:, rows.unit[piece]].T  # (m, E)
        off = (rows.target[piece, None].double() - every.of(columns[piece].double())).abs() / s
        total += (off.sum(dim=2).reshape(len(off), len(parts), -1) * mine[:, None]).sum(dim=(0, 2))
        count += int(mine.sum()) * off.shape[2]
    return (total / max(count, 1)).tolist()


@final
@dataclass(frozen=True, eq=False)
class _Members:
    """The problems of every member, and of all rows together."""

    each: Ridge
    whole: Ridge
    linear: Linear
    joints: int

    @staticmethod
    def of(rows: Rows, linear: Linear, watched: Tensor, stated: int, grams: Grams | None) -> "_Members":
        """Return the sums of all members over the rows that each trains on; `grams` are those of the columns, where they are known."""
        shared, joints, watch = linear.shared, rows.target.shape[1], watched[:, rows.unit]
        prior = slice(linear.law_size, linear.law_size + stated)
        s, g, member_g = right_hand_sides(linear.columns, shared, rows.target, watch)
        H, member_H = (grams or Grams.of(linear.columns, watch)).hessians(s, shared)
        size = torch.diagonal(H)
        tier = torch.full_like(size, ARM).long()
        tier[:linear.law_size] = linear.tiers
        for coefficients in torch.arange(shared, len(size)).chunk(joints) if linear.free_size else ():
            tier[coefficients[-linear.free_size:]] = FREE
        return _Members(Ridge.of(member_H, member_g, size, prior, tier), Ridge.of(H[None], g[None], size, prior, tier), linear, joints)

    @property
    def tiers(self) -> int:
        """How many tiers there may be."""
        return max(int(self.each.tier.max()) + 1, SURROUNDED)

    def part(self, theta: Tensor) -> LinearPart:
        """Return the coefficients `theta` (E, q) by what they belong to."""
        of_joint = theta[:, self.linear.shared:].reshape(len(theta), self.joints, -1).transpose(1, 2)
        odd = of_joint.shape[1] - self.linear.free_size
        return LinearPart(theta[:, :self.linear.shared], of_joint[:, :odd], of_joint[:, odd:])

    def both(self, weights: Sequence[Weights]) -> tuple[LinearPart, LinearPart]:
        """Return what each member, with its weights, makes of the rows that it trains on, and the same, its mean being that of all rows."""
        theta = torch.cat([self.each.of_member(e).theta([penalties])[0] for e, penalties in enumerate(weights)])
        whole = {penalties: self.whole.theta([penalties])[0, 0] for penalties in set(weights)}
        return self.part(theta), self.part(theta + (torch.stack([whole[penalties] for penalties in weights]) - theta).mean(dim=0))


def linear_part(rows: Rows, linear: Linear, watched: Tensor, stated: int, fades: bool = False,
                grams: Grams | None = None) -> tuple[LinearPart, LinearPart]:
    """Return the linear part of every member, twice: of the rows that it trains on alone, and moved so that the mean is that of all rows.

    The first tells what a member makes of recordings that it has not seen, the second is for use; members differ alike in both. `watched`
    (E, units) bool says which units a member leaves out; arm.yaml states the first `stated` coefficients of the body to be 0 +- 1. `fades`
    says whether there is a baseline to fade to. Free functions stay closed. `grams` are those of the columns, where they are known.
    """
    members = _Members.of(rows, linear, watched, stated, grams)
    tier, chosen = members.each.tier, [usual_weights(members.tiers)] * len(watched)
    if bool(watched[:, rows.unit].any()):
        judged = JudgedRows.of(rows, linear, tier, watched, fades)
        chosen = choice_of_each(lambda several: judged.losses(members.each.theta(several)), set(tier.tolist()), members.tiers, len(watched))
    return members.both(chosen)


def with_free_functions(rows: Rows, linear: Linear, watched: Tensor, stated: int, s: Tensor,
                    grams: Grams | None = None) -> tuple[LinearPart, LinearPart] | None:
    """Return the linear part with its free functions, twice as `linear_part` does; None where held-out recordings do not ask for them.

    They are judged by what is left of the torque, pooled over the recordings that members watch, in units of s (joints,) N m: a baseline
    that knows nothing of a line tells nothing of how far to trust it.
    """
    if not linear.free_size or not bool(watched[:, rows.unit].any()):
        return None
    members = _Members.of(rows, linear, watched, stated, grams)
    usual = usual_weights(members.tiers)
    free = [(*usual[:FREE], value, *usual[FREE + 1:]) for value in PENALTIES]
    parts = [members.part(theta) for theta in (*members.each.theta(free), *members.each.theta([usual]))]
    *found, closed = left_over(rows, parts, linear.columns, watched, s)
    best = min(range(len(free)), key=found.__getitem__)
    return members.both([free[best]] * len(watched)) if found[best] < FREE_WORTH * closed else None
