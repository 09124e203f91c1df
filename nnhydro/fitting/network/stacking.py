"""How much of what was learned is used beside the baseline, judged recording by recording on recordings held out of the fit.

    minimise over b in NETWORKS, q in CAUTIONS and, joint by joint, t_j in SHARES
                                            mean over recordings of  r / <r_0> + HARM_WEIGHT max(0, r/r_0 - 1),
    r = sum |target - t_j correction_b|,   r_0 = sum |target|,         trust_j = t_j / (t_j + (1 - t_j) f)

Sums run over a recording, <> over recordings. `target` is what the baseline leaves, correction_b what the members that did not train on a
recording make of it with b times their networks, shrunk by q times the disagreement of all members (models/learned/shrinkage.py), and
faded by q times the distance from the training. Those members have not seen its kind of motion: where what they learned holds for it all
the same, there is little to be cautious about. What is gained
counts in N m, what is spoilt by how many times worse than its baseline a recording becomes: that is what is promised of a hybrid.
The smallest share within a hair of the best is taken. The networks (b = 1) are left out (b = 0), or caution (q = 1) is given up, only
where that is better by more than a hair: the few members that watch a recording err more in their mean than all that are used. f is the
part of the recordings that a member is fitted to: the model, of all of them, has credit for what its members did not know.
Source: stacking, Wolpert (1992), Neural Networks 5, 241, Breiman (1996), Machine Learning 24, 49; the loss is ours.
"""

from collections.abc import Mapping, Sequence
from typing import TypeVar

import torch
from torch import Tensor

from nnhydro.models.learned.shrinkage import jackknife, shrink

SHARES = (0.0, 0.25, 0.5, 0.75, 0.9, 1.0)  # t: of what is learned beside the baseline, the smallest first
NETWORKS = (1.0, 0.0)  # b: with the networks, or the linear part alone
CAUTIONS = (1.0, 0.1)  # q: as much as members disagree, or a tenth of it
HARM_WEIGHT = 2.0  # what a recording is made worse counts this much beside its loss: never worse than the base is the aim
LEAST_GAIN = 0.01  # of the loss: networks, or more trust, are used from there on; less is chance among a handful of recordings
TINY = 1e-300
Choice = TypeVar("Choice")


def held_out(members: Tensor, mine: Tensor, scale: Tensor, left_out: float | None, caution: float = 1.0) -> Tensor:
    """Return what the members (E, n, joints) N m say together of rows (n,) that those in `mine` (E, n) have watched, (n, joints) N m.

    Of a hybrid it is as much as is used, shrunk by the disagreement of all members, each of whom has left out the share `left_out` of the
    recordings; None for a network.
    """
    weight = mine.double()[..., None]
    mean = (members * weight).sum(dim=0) / weight.sum(dim=0)
    return mean if left_out is None else shrink(mean, jackknife(members, left_out, caution), scale)


def losses(target: Tensor, correction: Tensor, unit: Tensor, shares: Sequence[float] = SHARES) -> Tensor:
    """Return r/<r_0> + HARM_WEIGHT max(0, r/r_0 - 1) (shares, recordings, joints) of `correction` for `target` (n, joints) N m.

    The rows are those of the recordings `unit` (n,).
    """
    _, place = torch.unique(unit, return_inverse=True)
    none = torch.zeros(int(place.max()) + 1, target.shape[1], dtype=torch.float64)

    def size(x: Tensor) -> Tensor:
        """Return the sum of |x| (recordings, joints) over each recording."""
        return none.index_add(0, place, x.abs())

    before = size(target)
    left = torch.stack([size(target - t * correction) for t in shares])
    harm = (left / before.clamp(min=TINY) - 1).clamp(min=0.0)
    found: Tensor = left / before.mean(dim=0).clamp(min=TINY) + HARM_WEIGHT * harm
    return found


def credit(share: Tensor, fitted: float) -> Tensor:
    """Return the share that suits a model of all recordings where `share` suits members of the part `fitted` of them.

    share = 1/(1 + e), e the variance of what is learned over its square, which falls as one over the number of recordings.
    """
    return share / (share + (1 - share) * fitted).clamp(min=TINY)


def stack(target: Tensor, candidates: Mapping[Choice, Tensor], unit: Tensor, shares: Sequence[float] = SHARES) -> tuple[Choice, Tensor]:
    """Return which of the `candidates`, the first preferred, and trust (joints,) for `target` (n, joints) N m and their corrections
    (n, joints) N m.
    """
    best, found = torch.inf, (next(iter(candidates)), torch.ones(target.shape[1], dtype=torch.float64))
    for choice, correction in candidates.items():
        found_losses = losses(target, correction, unit, shares).mean(dim=1)
        least = found_losses.amin(dim=0)
        if float(least.mean()) < (1 - LEAST_GAIN) * best:
            first = (found_losses <= (1 + LEAST_GAIN) * least).int().argmax(dim=0)
            best, found = float(least.mean()), (choice, torch.tensor(shares, dtype=torch.float64)[first])
    return found
