"""The score of one set of effects: evidence, priors, physical bounds, and what it grants to errors of form.

    score(S) = log int p(y | S, tau) d log tau + sum_k log [posterior mass within bounds / prior mass within bounds]
               + sum_k log prior(k) - FORM^2 u(S) + log UNLISTED/(1 - UNLISTED) if u(S) > 0

u(S): nats that the unknown gains beside S. That it is needed is as probable as a cause outside the catalogue. Named laws are known to
FORM in form: what that costs them is no evidence for the unknown, which may be needed for other reasons, too.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve

from nnhydro.diagnosis.constants import FORM, UNLISTED
from nnhydro.diagnosis.model.evidence import Posterior
from nnhydro.diagnosis.model.sizes import Sizes, fit_sizes, nats_of_sizes, none, without_unknown
from nnhydro.diagnosis.search.library import bound_bonus
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary

Array = NDArray[np.float64]
IMPOSSIBLE = -1e6  # nats of values that make no physical sense together
ODDS = float(np.log(1 / UNLISTED - 1))  # nats that speak against an unknown
LARGE_START, SMALL_START = 0.1, 0.004  # sizes of the unknown, in rms torques, from which its evidence is also maximised


@final
@dataclass(frozen=True, eq=False)
class ScoredSet:
    """A set of hypotheses (numbers in the library) with its score, fit, sizes, and the nats that the unknown gains beside it."""

    chosen: tuple[int, ...]
    score: float
    fit: Posterior
    sizes: Sizes
    unknown_nats: float

    def places(self, view: WeightedLibrary) -> dict[int, slice]:
        """Return where the coefficients of each hypothesis lie in the fit."""
        start, found = len(view.whitened.b), {}
        for k in self.chosen:
            width = view.columns(k).Xw.shape[2]
            found[k] = slice(start, start + width)
            start += width
        return found

    def without(self, *members: int) -> tuple[int, ...]:
        """Return the numbers of the hypotheses less those of `members`."""
        return tuple(k for k in self.chosen if k not in members)


def score_set(view: WeightedLibrary, start: Sizes, chosen: tuple[int, ...]) -> ScoredSet:
    """Return the set `chosen`, fitted with the unknown's best sizes, climbed from `start` and from a large and a small unknown."""
    whitened, columns = view.whitened, view.join(chosen)
    starts = [start, Sizes.even(whitened, LARGE_START), Sizes(np.minimum(start.tau, SMALL_START))]
    fit, sizes = max((fit_sizes(whitened, columns, s) for s in starts), key=lambda found: found[0].log_evidence)
    off = without_unknown(whitened, columns)
    doubt = ODDS + nats_of_sizes(whitened, fit, sizes)
    if off.log_evidence > fit.log_evidence - doubt:
        fit, sizes, doubt = off, none(whitened), 0.0
    unknown = max(fit.log_evidence - off.log_evidence, 0.0)
    score = fit.log_evidence - doubt - FORM**2 * unknown + _bonus(view, chosen, fit)
    return ScoredSet(chosen, score, fit, sizes, unknown)


def _bonus(view: WeightedLibrary, chosen: tuple[int, ...], fit: Posterior) -> float:
    """Return the nats of priors, and of the physical bounds within which the fit lies."""
    if not chosen:
        return 0.0
    start, total, variances = len(view.whitened.b), 0.0, fit.variances()
    library = view.library
    for k in chosen:
        width = view.columns(k).Xw.shape[2]
        total += library.log_prior(k)
        low, high = library.bounds(k)
        at, sets = slice(start, start + width), width // max(len(low), 1)  # of every recording that has values of its own
        total += bound_bonus(np.tile(low, sets), np.tile(high, sets), fit.mean[at], np.sqrt(variances[at]) * fit.scale[at])
        total += 0.0 if makes_sense(view, k, fit.mean[at]) else IMPOSSIBLE
        start += width
    return total


def makes_sense(view: WeightedLibrary, k: int, scaled: Array) -> bool:
    """Return whether the `scaled` values of hypothesis `k`, within their bounds, make physical sense together."""
    library = view.library
    h, (low, high) = library.hypotheses[k], library.bounds(k)
    return h.per_recording or h.plausible(np.clip(scaled, low, high) * library.scale[library.at(k)])


def imitated_nats(view: WeightedLibrary, found: ScoredSet, k: int) -> float:
    """Return the nats of the torque u of member `k` that the unknown can make of what the baseline cannot.

        (c'(G + 1/L)^-1 c - c_Y'(G_Y + 1)^-1 c_Y) / 2,    c = A'W u,  L: an unknown of LARGE_START of the torque
    """
    whitened, columns = view.whitened, view.columns(k)
    cross, p = columns.cross @ found.fit.mean[found.places(view)[k]], whitened.p
    t = Sizes.even(whitened, LARGE_START).vector(whitened)
    M = whitened.G * t[:, None] * t + np.eye(len(t))
    imitated = float((t * cross) @ solve(M, t * cross, assume_a="pos"))
    return (imitated - float(cross[:p] @ np.linalg.solve(whitened.G[:p, :p] + np.eye(p), cross[:p]))) / 2
