"""Which tiers of coefficients a linear part opens, and with which penalties: chosen on recordings that members have left out of their fit.

    weights = those with least loss (stacking.py) on a sample of the watched recordings, each weighing -ln u, u uniform

Tiers are opened one after the other, the plainest first; one stays closed that does not gain WORTH. Which of them gain on a handful of
recordings is a matter of chance: each member draws a sample of its own, and what the members say together is the mean over samples. Source:
Rubin (1981), Ann. Statist. 9, 130 (Bayesian bootstrap); Breiman (1996), Machine Learning 24, 123 (means of unstable choices).
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
import torch
from torch import Tensor

from nnhydro.features.strip_law.law import ACCELERATED, ARM, NEURONS, REMEMBERED, SURROUNDED, SWUNG
from nnhydro.fitting.linear.normal_equations import CLOSED, Weights
from nnhydro.fitting.network.linear_columns import Linear
from nnhydro.fitting.network.rows import Rows
from nnhydro.fitting.network.stacking import SHARES, held_out, losses

PENALTIES = tuple(10.0**k for k in range(1, -6, -1))  # lambda of a tier
MEAN_PENALTY = 1e-4
UNWATCHED = (MEAN_PENALTY, 1e-2, 1e-2, 1e-2, 1e-1, 1e-1, CLOSED)  # where no recording can be watched; sets of surroundings as ARM
WORTH = 0.98  # of the loss without the tier; memory over travel is opened wherever it gains at all
SEED = 0
MOST = 10_000  # watched rows looked at in a choice


def usual_weights(tiers: int) -> Weights:
    """Return the weights of `tiers` tiers where no recording can be watched."""
    return (*UNWATCHED, *(UNWATCHED[ARM] for _ in range(tiers - SURROUNDED)))


def chosen_weights(loss: Callable[[Sequence[Weights]], Sequence[float]], there: Collection[int], tiers: int) -> Weights:
    """Return the weights of `tiers` tiers, of which those `there` are opened in turn, each adjusted once more at the end.

    `loss` is asked for several weights at a time, which differ in one tier alone and close the same tiers.
    """
    weights = [MEAN_PENALTY, *(CLOSED for _ in range(tiers - 1))]

    def best_of(tier: int, values: Sequence[float]) -> tuple[float, float]:
        """Return the best weight of `tier` among `values`, and its loss."""
        found = loss([(*weights[:tier], value, *weights[tier + 1:]) for value in values])
        return min(zip(values, found, strict=True), key=lambda pair: pair[1])

    order = [tier for tier in (REMEMBERED, SWUNG, ACCELERATED, NEURONS, *range(SURROUNDED, tiers), ARM) if tier in there]
    for tier in order:
        best, left = best_of(tier, PENALTIES)
        if left < (1.0 if tier == REMEMBERED else WORTH) * loss([tuple(weights)])[0]:
            weights[tier] = best
    for tier in order:
        if weights[tier] < CLOSED:
            weights[tier], _ = best_of(tier, [weights[tier] * factor for factor in (0.316, 1.0, 3.16)])
    return tuple(weights)


def choice_of_each(losses: Callable[[Sequence[Weights]], Tensor], there: Collection[int], tiers: int, members: int) -> list[Weights]:
    """Return the weights that each member chooses; `losses` gives (several, shares, recordings, joints) of weights they share."""
    known: dict[Weights, Tensor] = {}

    def of(several: Sequence[Weights]) -> Tensor:
        """Return the losses of `several` weights, computed where they are not known yet."""
        new = [weights for weights in several if weights not in known]
        known.update(zip(new, losses(new), strict=True) if new else ())
        return torch.stack([known[weights] for weights in several])

    def loss_on(draw: Tensor) -> Callable[[Sequence[Weights]], Sequence[float]]:
        """Return the loss of weights on the recordings as drawn, joint by joint with the best share."""
        return lambda several: ((of(several) * draw[:, None]).sum(dim=2) / draw.sum()).amin(dim=1).mean(dim=1).tolist()

    count = of([(MEAN_PENALTY, *(CLOSED for _ in range(tiers - 1)))]).shape[2]
    draws = torch.from_numpy(np.random.default_rng(SEED).exponential(size=(members, count)))
    return [chosen_weights(loss_on(draw), there, tiers) for draw in draws]


@final
@dataclass(frozen=True, eq=False)
class JudgedRows:
    """MOST rows, evenly spaced, that members watch. Columns lie together by tier, so that those of closed tiers are not read."""

    shape: tuple[int, int]  # joints, rows
    shared: list[tuple[Tensor, Tensor]]  # of a tier: places (k,) of the coefficients that joints share, and columns (k, joints rows) N m
    per_joint: list[tuple[Tensor, Tensor]]  # of a joint: places (k,) of its own coefficients, and columns (k, rows) N m
    loss: Callable[[Tensor], Tensor]  # (shares, recordings, joints) of torques (E, rows, joints) N m, stacking.py

    @staticmethod
    def of(rows: Rows, linear: Linear, tier: Tensor, watched: Tensor, fades: bool) -> "JudgedRows":
        """Return the rows that members watch, `watched` (E, units); `tier` (q,) is that of each coefficient.

        `fades` says whether there is a baseline to fade to.
        """
        index = watched.any(dim=0)[rows.unit].nonzero().ravel()
        index = index[::len(index) // MOST + 1]
        columns = linear.columns[index].permute(2, 1, 0).double()  # (p, joints, rows)
        scale, unit, mine = rows.scale[index].double(), rows.unit[index], watched[:, rows.unit[index]]
        target, left_out = rows.target_of(index, mine), float(watched.double().mean()) if fades else None
        places = [(tier[:linear.shared] == number).nonzero().ravel() for number in torch.unique(tier[:linear.shared])]
        per_joint = torch.arange(linear.shared, len(tier)).reshape(columns.shape[1], -1)
        return JudgedRows((columns.shape[1], columns.shape[2]), [(place, columns[place].flatten(1)) for place in places],
                          [(place, columns[linear.shared:, j].contiguous()) for j, place in enumerate(per_joint)],
                          lambda torques: losses(target, held_out(torques, mine, scale, left_out), unit, SHARES if fades else (1.0,)))

    def losses(self, theta: Tensor) -> Tensor:
        """Return the losses (several, shares, recordings, joints) of the coefficients `theta` (several, E, q)."""
        each = theta.flatten(0, 1)
        torques = torch.zeros(len(each), *self.shape, dtype=torch.float64)
        for place, columns in self.shared:
            if bool(each[:, place].any()):
                torques.flatten(1).addmm_(each[:, place], columns)
        for j, (place, columns) in enumerate(self.per_joint):
            if bool(each[:, place].any()):
                torques[:, j] += each[:, place] @ columns
        each_set = torques.transpose(1, 2).contiguous().reshape(*theta.shape[:2], -1, self.shape[0])
        return torch.stack([self.loss(members) for members in each_set])
