"""Which tiers of coefficients a linear part opens, and with which penalties: chosen on recordings that members have left out of their fit.

    weights = those with least loss (stacking.py) on a sample of the watched recordings, each weighing -ln u, u uniform

Tiers are opened one after the other, the plainest first; one stays closed that does not gain WORTH. Which of them gain on a handful of
recordings is a matter of chance: each member draws a sample of its own, and what the members say together is the mean over samples. Source:
Rubin (1981), Ann. Statist. 9, 130 (Bayesian bootstrap); Breiman (1996), Machine Learning 24, 123 (means of unstable choices).
"""

from collections.abc import Callable, Collection
from functools import cache

import numpy as np
import torch
from torch import Tensor

from nnhydro.features.strip_law import ACCELERATED, ARM, NEURONS, REMEMBERED, SURROUNDED, SWUNG

Weights = tuple[float, ...]  # lambda of each tier

PENALTIES = tuple(10.0**k for k in range(1, -6, -1))  # lambda of a tier
CLOSED = 1e9  # lambda that leaves a tier out
MEAN_PENALTY = 1e-4
UNWATCHED = (MEAN_PENALTY, 1e-2, 1e-2, 1e-2, 1e-1, 1e-1, CLOSED)  # where no recording can be watched; sets of surroundings as ARM
WORTH = 0.98  # of the loss without the tier; memory over travel is opened wherever it gains at all
SEED = 0


def usual_weights(tiers: int) -> Weights:
    """Return the weights of `tiers` tiers where no recording can be watched."""
    return (*UNWATCHED, *(UNWATCHED[ARM] for _ in range(tiers - SURROUNDED)))


def chosen_weights(loss: Callable[[Weights], float], there: Collection[int], tiers: int) -> Weights:
    """Return the weights of `tiers` tiers, of which those `there` are opened in turn, each adjusted once more at the end."""
    weights = [MEAN_PENALTY, *(CLOSED for _ in range(tiers - 1))]

    def at(tier: int, value: float) -> Weights:
        return (*weights[:tier], value, *weights[tier + 1:])

    order = [tier for tier in (REMEMBERED, SWUNG, ACCELERATED, NEURONS, *range(SURROUNDED, tiers), ARM) if tier in there]
    for tier in order:
        best = min(PENALTIES, key=lambda value: loss(at(tier, value)))
        if loss(at(tier, best)) < (1.0 if tier == REMEMBERED else WORTH) * loss(tuple(weights)):
            weights[tier] = best
    for tier in order:
        if weights[tier] < CLOSED:
            near = [weights[tier] * factor for factor in (0.316, 1.0, 3.16)]
            weights[tier] = min(near, key=lambda value: loss(at(tier, value)))
    return tuple(weights)


def choice_of_each(losses: Callable[[Weights], Tensor], there: Collection[int], tiers: int, members: int) -> list[Weights]:
    """Return the weights that each member chooses; `losses` gives (shares, recordings, joints) of weights that all members have."""
    known = cache(losses)
    count = known(usual_weights(tiers)).shape[1]
    draws = torch.from_numpy(np.random.default_rng(SEED).exponential(size=(members, count)))

    def loss_on(draw: Tensor) -> Callable[[Weights], float]:
        """Return the loss of weights on the recordings as drawn, joint by joint with the best share."""
        return lambda weights: float(((known(weights) * draw[:, None]).sum(dim=1) / draw.sum()).amin(dim=0).mean())

    return [chosen_weights(loss_on(draw), there, tiers) for draw in draws]
