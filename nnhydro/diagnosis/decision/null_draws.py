"""How much a law must gain in this very campaign: more than by chance, of which the fitted null is drawn in Gram space.

    c = X'W^1/2 e - C'L^-1 (A'W^1/2 e - f) ~ N(0, R),  R = X'WX - C'C,      gain_k = 1/2 [RHO^2 c'(I + RHO^2 R)^-1 c - log|I + RHO^2 R|]

with e, f ~ N(0, 1), rows of noise and coefficients of the fit A = scaled baseline, unknown and laws, LL' = M its precision. Under the null
the projected products of all columns with the torque are jointly normal with the projected Gram matrix, which is never made itself; every
law of every key takes part, so that the look-elsewhere effect is included.
The covariance is right since X'W^1/2 A = C'L': X'WX + C'C - 2 C'C.
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import LEAST_GAIN, NULL_DRAWS, NULL_QUANTILE, RHO
from nnhydro.diagnosis.model.evidence import added_evidence
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary

Array = NDArray[np.float64]


def null_gains(search: Search, found: ScoredSet, seed: int) -> Array:
    """Return the largest gain (draws,) of a single law in campaigns drawn from the fit `found` without it, prior included.

    Of a law that is expected, the prior is that of even odds: else its chance gains would be asked of all others.
    """
    view: WeightedLibrary = search.view
    fit, columns = found.fit, view.join(found.chosen)
    e, Xe = view.noise_draws(seed, NULL_DRAWS)
    Ae = view.whitened.cross(e)
    if columns is not None:
        Ae = np.concatenate([Ae, columns.Xw.reshape(-1, columns.Xw.shape[2]).T @ e.reshape(-1, NULL_DRAWS)])
    f = np.random.default_rng([seed, 1]).standard_normal(Ae.shape)
    C = view.projection(found.chosen, fit)
    c = Xe.T - C.T @ fit.factor.forward((Ae * fit.scale[:, None] - f)[fit.live])  # (K, draws)
    best = np.full(NULL_DRAWS, -np.inf)
    prior = np.array([view.library.log_prior(int(k)) - view.library.log_expected(int(k)) for k in view.shared])
    for width, laws in view.alike.items():
        M = RHO**2 * view.remainders(laws, C) + np.eye(width)
        _, gain = added_evidence(M, c[laws.at])  # (laws, draws)
        best = np.maximum(best, (gain + prior[laws.which][:, None]).max(axis=0))
    return best


def null_threshold(search: Search, found: ScoredSet, seed: int) -> float:
    """Return the quantile of the largest chance gain, nats."""
    return float(np.quantile(null_gains(search, found, seed), NULL_QUANTILE))


def least_gain(library: Library, chance: float, k: int) -> float:
    """Return the gain, nats, that a claim of hypothesis `k` must exceed where the `null_threshold` is `chance`."""
    return max(LEAST_GAIN, chance + library.log_expected(k))
