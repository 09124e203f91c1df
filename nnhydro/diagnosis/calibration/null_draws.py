"""How much a law gains by chance in this very campaign: draws of the fitted null in Gram space.

    c ~ N(0, R),  R = X'WX - C'C,      gain_k = 1/2 [RHO^2 c'(I + RHO^2 R)^-1 c - log|I + RHO^2 R|]

Under the null the projected products of all columns with the torque are jointly normal with the projected Gram matrix; every law of every
key takes part, so that the look-elsewhere effect is paid as it is. Only rows' products are drawn, never rows.
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import NULL_DRAWS, NULL_QUANTILE, RHO
from nnhydro.diagnosis.search.library import View
from nnhydro.diagnosis.search.stepwise import Scored, Search

Array = NDArray[np.float64]


def null_gains(search: Search, beside: Scored, seed: int) -> Array:
    """Return the largest gain (draws,) of a single law, prior included, in campaigns drawn from the fit `beside` without it."""
    from scipy.linalg import solve_triangular

    view: View = search.view
    columns = view.joined(beside.chosen)
    cross = view.cross
    if columns is not None:
        k = columns.Xw.shape[2]
        cross = np.concatenate([cross, columns.Xw.reshape(-1, k).T @ view.Xw.reshape(-1, view.Xw.shape[2])])
    C = solve_triangular(beside.fit.chol, cross * beside.fit.scale[:, None], lower=True, check_finite=False)
    R = view.gram - C.T @ C
    values, vectors = np.linalg.eigh((R + R.T) / 2)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws = root @ np.random.default_rng(seed).standard_normal((len(R), NULL_DRAWS))  # (K, draws)
    best = np.full(NULL_DRAWS, -np.inf)
    prior = np.array([view.library.log_prior(int(k)) for k in view.shared])
    for width in np.unique(view.widths):
        which = np.flatnonzero(view.widths == width)
        at = view.starts[which][:, None] + np.arange(width)
        M = RHO**2 * R[at[:, :, None], at[:, None, :]] + np.eye(width)
        c = draws[at]  # (laws, width, draws)
        gain = 0.5 * (RHO**2 * (c * np.linalg.solve(M, c)).sum(axis=1) - np.linalg.slogdet(M)[1][:, None]) + prior[which][:, None]
        best = np.maximum(best, gain.max(axis=0))
    return best


def null_threshold(search: Search, beside: Scored, seed: int) -> float:
    """Return the quantile of the largest chance gain, nats."""
    return float(np.quantile(null_gains(search, beside, seed), NULL_QUANTILE))
