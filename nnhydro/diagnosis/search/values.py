"""Values of the members of a set and their covariance, in the units of their effects.

Values are those of the fit without the unknown: the unknown is what is orthogonal to the named effects and must not take from their size.
Their covariance is the posterior's, widened where the scores of the recordings scatter by more than the noise says (a law of another form,
something left over):

    C_i -> C_i max(1, [H^-1 (sum_g s_g s_g') H^-1]_ii G / (G - 1) / C_ii),   s_g = D_g' r_g,  g the recordings, blocks where they are few

to what they are known to over the noise of the evidence, which grants every law an error of its form, and by what a smooth error of the
models' form would move them, the same in every recording and so without scatter:

    C -> C + H^-1 D'W Phi T^2 Phi'W D H^-1,     T: an unknown of BASELINE_FORM of the torque and of as much as it makes of the rest

Source: orthogonal discrepancy, Plumlee (2017), J. Am. Stat. Assoc. 112; Liang & Zeger (1986), Biometrika 73.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import BASELINE_FORM, FEW_NATS
from nnhydro.diagnosis.model.sizes import Sizes, without_unknown
from nnhydro.diagnosis.search.best_fit import BestFit, best_fit, fit_at
from nnhydro.diagnosis.search.stepwise import LARGE_START, ScoredSet, Search
from nnhydro.fitting.linear.least_squares import ridge

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FEWEST_UNITS = 6  # recordings from which their scatter is counted; of fewer that of blocks


@final
@dataclass(frozen=True, eq=False)
class Values:
    """Linear values (p,) of a member in its units and their covariance (p, p)."""

    mean: Array
    covariance: Array
    bounded: bool = False  # whether a value was cut at a physical bound other than 0


def _scatter(search: Search, fit: BestFit, covariance: Array, at: Index) -> Array:
    """Return the variance (m,) of the coefficients `at` among the fit's own that the scatter of the recordings' scores gives."""
    problem = search.view.library.design.problem
    unit = problem.group_of if problem.groups >= FEWEST_UNITS else problem.block_of
    scores = np.stack([np.einsum("njk,nj->k", fit.rows[unit == g], fit.residual[unit == g]) for g in np.unique(unit)])
    variances: Array = ((scores @ covariance[:, at]) ** 2).sum(axis=0) * len(scores) / max(len(scores) - 1, 1)
    return variances


def _form(fit: BestFit, share: float, covariance: Array, at: Index) -> Array:
    """Return the covariance (m, m) of the coefficients `at` that a smooth error of `share` of the torque gives."""
    whitened = fit.whitened
    assert fit.columns is not None
    between = np.concatenate([whitened.G[: whitened.p, whitened.p:], fit.columns.cross[whitened.p:].T])
    moved = covariance[at] @ between * (share * whitened.unknown_of_unit_share)
    made: Array = moved @ moved.T
    return made


def _smooth_share(found: ScoredSet, fit: BestFit) -> float:
    """Return the share of the torque that the unknown makes of what `fit` leaves, 0 where it gains nothing to speak of beside `found`."""
    if found.unknown_nats <= FEW_NATS:
        return 0.0
    whitened, p, share = fit.whitened, fit.whitened.p, 0.0
    t = Sizes.even(whitened, LARGE_START).vector(whitened)[p:]
    for j in range(whitened.joints):
        at = slice(j * whitened.m, (j + 1) * whitened.m)
        Phi = whitened.Phi * t[at]
        scaled = Phi * whitened.sw[:, j:j + 1]
        smooth = Phi @ ridge(scaled, fit.residual[:, j])
        share = max(share, float(np.sqrt((smooth**2).sum() / whitened.design.time) / whitened.design.scale[j]))
    return share


def values_of(search: Search, found: ScoredSet, k: int, beside: BestFit | None = None) -> Values:
    """Return the values of member `k`: without the unknown, the spread widened to that of the recordings and by the baseline's form.

    The noise is that of `beside` where it is given: a neighbour's is not found again.
    """
    view, library = search.view, search.view.library
    fit = best_fit(search, found) if beside is None else fit_at(search, found, beside.whitened.v)
    place, h = found.places(view)[k], library.hypotheses[k]
    at = np.searchsorted(fit.own, np.arange(place.start, place.stop))
    whole = fit.posterior.covariance(fit.own)
    covariance = whole[np.ix_(at, at)]
    least = np.diag(without_unknown(view.whitened, view.join(found.chosen)).covariance(
        np.arange(place.start, place.stop)))
    wanted = np.maximum(_scatter(search, fit, whole, at), least)
    widening = np.sqrt(np.maximum(wanted / np.maximum(np.diag(covariance), 1e-300), 1.0))
    share = float(np.hypot(BASELINE_FORM, _smooth_share(found, fit)))
    covariance = covariance * widening[:, None] * widening + _form(fit, share, whole, at)
    mean = fit.posterior.mean[place]
    if h.per_recording:
        mean, covariance = _pool(mean.reshape(-1, h.width), covariance, h.width)
    low, high = library.bounds(k)
    scale = library.scale[library.at(k)]
    bounded = bool(np.any(((mean > high) & (high != 0)) | ((mean < low) & (low != 0))))
    return Values(np.clip(mean, low, high) * scale, covariance * scale[:, None] * scale, bounded)


def _pool(beta: Array, covariance: Array, width: int) -> tuple[Array, Array]:
    """The rms (width,) over recordings of values of each recording's own, and its covariance."""
    rms = np.sqrt((beta**2).mean(axis=0))
    variances = np.diag(covariance).reshape(-1, width)
    count = len(beta)
    spread = (beta**2 * variances).sum(axis=0) / np.maximum(count**2 * rms**2, 1e-300)
    return rms, np.diag(spread)
