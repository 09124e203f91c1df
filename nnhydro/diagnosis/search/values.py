"""Values of the members of a set and their covariance, in the units of their effects.

Values are those of the fit without the unknown, which must not take from the size of the named effects.
Their covariance is the posterior's, widened where the scores of the recordings scatter by more than the noise says (a law of another form,
something left over):

    C_i -> C_i max(1, [H^-1 (sum_g s_g s_g') H^-1]_ii G / (G - 1) / C_ii),   s_g = D_g' r_g,  g the recordings, blocks where they are few

It is at least the posterior under the noise of the evidence and an error of the law's form and timing (FORM, LATE). It also includes the
effect of a smooth error of the model's form, which is the same in every recording and so causes no scatter:

    C -> C + H^-1 D'W Phi T^2 Phi'W D H^-1,     T: an unknown of MODEL_ERROR of the torque and of as much as it makes of the rest

Where nothing is driven, loads are known relative to the model's largest part: C -> C + s^2 beta beta',  s its relative uncertainty. The
interval of a quantity q(beta) grows by what it changes at beta / f and beta f,  ln f = Z95 sqrt(ln(1 + s^2)): no scale is negative.

Source: orthogonal discrepancy, Plumlee (2017), J. Am. Stat. Assoc. 112; Liang & Zeger (1986), Biometrika 73.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.conventions import Z95
from nnhydro.diagnosis.constants import FEW_NATS, MODEL_ERROR
from nnhydro.diagnosis.model.sizes import Sizes
from nnhydro.diagnosis.noise.spectrum import form_variance
from nnhydro.diagnosis.problem.hypothesis import AnyEffect
from nnhydro.diagnosis.search.best_fit import BestFit, best_fit
from nnhydro.diagnosis.search.scored_set import LARGE_START, ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.tangents import Tangents, tangents_of
from nnhydro.effects.quantity import Interval, Quantity, intervals
from nnhydro.fitting.linear.least_squares import ridge

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FEWEST_UNITS = 6  # fewest recordings whose scatter is measured; of fewer, that of blocks is


@final
@dataclass(frozen=True, eq=False)
class Values:
    """Linear values (p,) of a member in its units, and the covariance of these and of `names`, its nonlinear values."""

    mean: Array
    covariance: Array  # (p + names, p + names)
    bounded: bool = False  # whether a value was cut at a physical bound other than 0
    names: tuple[str, ...] = ()

    def with_scale_known_to(self, spread: float) -> "Values":
        """Return the same where the scale of all torques, and of these linear values with it, has the relative deviation `spread`."""
        moved = np.concatenate([self.mean * spread, np.zeros(len(self.covariance) - len(self.mean))])
        return replace(self, covariance=self.covariance + np.outer(moved, moved))


def units_of(search: Search) -> Index:
    """Return the unit (n,) of every row: its recording, its block where the recordings are few."""
    problem = search.view.library.design.problem
    return problem.group_of if problem.groups >= FEWEST_UNITS else problem.block_of


def _scatter(search: Search, fit: BestFit, covariance: Array, at: Index) -> Array:
    """Return the variance (m,) of the coefficients `at` among the fit's own that the scatter of the recordings' scores gives."""
    unit = units_of(search)
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
    """Return the share of the torque that the unknown makes of what `fit` leaves, 0 where it gains little beside `found`."""
    if found.unknown_nats <= FEW_NATS:
        return 0.0
    whitened, p, share = fit.whitened, fit.whitened.p, 0.0
    t = Sizes.even(whitened, LARGE_START).vector(whitened)[p:]
    for j in range(whitened.joints):
        at = slice(j * whitened.m, (j + 1) * whitened.m)
        Phi = whitened.Phi * t[at]
        scaled = Phi * whitened.sw[:, j:j + 1]
        smooth = Phi @ ridge(scaled, fit.residual[:, j])
        share = max(share, float(np.sqrt((smooth**2).sum() / whitened.design.duration) / whitened.design.scale[j]))
    return share


def _covariance(search: Search, found: ScoredSet, fit: BestFit, at: Index) -> Array:
    """Return the covariance of the coefficients `at` of `fit`, at least that over noise and the law's error of form and timing."""
    mine = np.searchsorted(fit.coefficients, at)
    whole = fit.posterior.covariance(fit.coefficients)
    covariance = whole[np.ix_(mine, mine)]
    noisier = fit.whitened.v / (search.whitened.v + form_variance(fit.whitened.design))
    H = np.einsum("njk,nj,njl->kl", fit.rows, noisier, fit.rows, optimize=True) + np.diag(fit.posterior.scale[fit.coefficients] ** -2.0)
    wanted = np.maximum(_scatter(search, fit, whole, mine), np.diag(np.linalg.inv(H))[mine])
    widening = np.sqrt(np.maximum(wanted / np.maximum(np.diag(covariance), 1e-300), 1.0))
    share = float(np.hypot(MODEL_ERROR, _smooth_share(found, fit)))
    made: Array = covariance * widening[:, None] * widening + _form(fit, share, whole, mine)
    return made


def values_of(search: Search, found: ScoredSet, k: int, tangents: Tangents | None = None) -> Values:
    """Return the values of member `k`: without the unknown, the spread widened to that of the recordings and by the baseline's form.

    With the `tangents` of the set, they hold how its nonlinear values are known, beside those of all members.
    """
    view, library = search.view, search.view.library
    h, fit = library.hypotheses[k], best_fit(search, found)
    place, linear, factor = found.places(view)[k], fit.posterior.mean, fit.scale_factor
    at, unit, names = np.arange(place.start, place.stop), np.ones(0), tuple[str, ...]()
    if tangents is not None:
        more = tangents.at(k)
        names, unit = tuple(tangents.names[i][1] for i in more), tangents.unit[more]
        at = np.concatenate([at, len(linear) + more])
        fit = fit.with_columns(tangents.append_to(fit.whitened, fit.columns))
    covariance = _covariance(search, found, fit, at)
    mean = linear[place]
    if h.per_recording:
        mean, covariance = _pool(mean.reshape(-1, h.width), covariance)
    low, high = library.bounds(k)
    scale = library.scale[library.at(k)]
    bounded = bool(np.any(((mean > high) & (high != 0)) | ((mean < low) & (low != 0))))
    units = np.concatenate([scale / factor, unit])
    return Values(np.clip(mean / factor, low, high) * scale, covariance * units[:, None] * units, bounded, names)


def quantity_intervals(effect: AnyEffect, values: Values) -> dict[str, Interval]:
    """Return the 95 % interval of every quantity of `effect`, whose linear `values` (p,) are: by the delta rule, cut at physical bounds."""
    p = len(effect.linear_names())
    at = [*range(p), *range(len(values.covariance) - len(values.names), len(values.covariance))]  # without a constant of its own
    mean = np.concatenate([values.mean[:p], [getattr(effect, name)[0] for name in values.names]])
    bounds = {field.name: field.metadata["bounds"] for field in effect.parameters()}
    limits = {p + i: bounds[name] for i, name in enumerate(values.names)}

    def quantities(x: torch.Tensor) -> Mapping[str, Quantity]:
        """Return the effect's quantities at linear values and shape parameters `x`."""
        changes: dict[str, Any] = {name: (float(v),) * len(getattr(effect, name)) for name, v in zip(values.names, x[p:], strict=True)}
        return replace(effect.with_linear(x[:p]), **changes).quantities()

    found = intervals(quantities, torch.from_numpy(mean), torch.from_numpy(values.covariance[np.ix_(at, at)]), limits)
    for name, (low, high) in found.items():
        least, most = bounds.get(name.partition("[")[0], (-np.inf, np.inf))
        if high > least and low < most:
            found[name] = max(low, least), min(high, most)
    return found


def intervals_of_scale(effect: AnyEffect, spans: Mapping[str, Interval], spread: float) -> dict[str, Interval]:
    """Return the intervals `spans` of the quantities of `effect` where all loads are known to a factor of relative deviation `spread`."""
    factor, values, here = float(np.exp(Z95 * np.sqrt(np.log1p(spread**2)))), effect.linear_values(), effect.quantities()
    ends = [effect.with_linear(values * times).quantities() for times in (1 / factor, factor)]
    made = {}
    for name, (low, high) in spans.items():
        value, (first, last) = here[name].value, sorted(end[name].value for end in ends)
        made[name] = value - float(np.hypot(value - low, value - first)), value + float(np.hypot(high - value, last - value))
    return made


def says_nothing(search: Search, found: ScoredSet, k: int) -> bool:
    """Return whether member `k` has nonlinear values and the interval of each of its sizes holds 0.

    A size is a quantity that is 0 where the linear values are: that a wall lies in some direction does not say whether there is one.
    """
    tangents, h = tangents_of(search, found), search.view.library.hypotheses[k]
    if tangents is None or not len(tangents.at(k)):
        return False
    values = values_of(search, found, k, tangents)
    spans = quantity_intervals(h.with_values(torch.from_numpy(values.mean.copy())), values)
    absent = h.with_values(torch.zeros(len(values.mean), dtype=torch.float64)).quantities()
    sizes = [span for name, span in spans.items() if absent[name].value == 0]
    return bool(sizes) and all(low <= 0 <= high for low, high in sizes)


def _pool(beta: Array, covariance: Array) -> tuple[Array, Array]:
    """The rms (width,) over recordings of values (recordings, width) of each one's own, and its covariance with what follows them.

        r = sqrt(sum_g w_g beta_g^2),   dr / dbeta_g = w_g beta_g / r,   w_g ~ 1 / (var_g + t^2),  t^2 the variance between recordings

    A recording that hardly determines its value counts little. Source: DerSimonian & Laird (1986), Control. Clin. Trials 7.
    """
    count, width = beta.shape
    within = np.diag(covariance)[: beta.size].reshape(count, width).mean(axis=1)
    between = _variance_between(np.sqrt((beta**2).sum(axis=1)), within)
    weight = 1.0 / np.maximum(within + between, 1e-300)
    weight /= weight.sum()
    rms = np.sqrt(weight @ beta**2)
    J = np.zeros((width + len(covariance) - beta.size, len(covariance)))
    for i in range(width):
        J[i, i: beta.size: width] = weight * beta[:, i] / np.maximum(rms[i], 1e-300)
    J[width:, beta.size:] = np.eye(len(covariance) - beta.size)
    spread = covariance.copy()
    spread[np.diag_indices(beta.size)] += between
    return rms, J @ spread @ J.T


def excess_scatter(sizes: Array, weights: Array) -> float:
    """Return Cochran's Q of `sizes` (n,) less n - 1, its mean if they scatter as the inverse `weights` (n,) say."""
    return float(weights @ (sizes - np.average(sizes, weights=weights)) ** 2) - (len(sizes) - 1)


def _variance_between(sizes: Array, variances: Array) -> float:
    """Return by how much `sizes` (recordings,) vary beyond their own `variances`: the estimate by moments of DerSimonian and Laird."""
    w = 1.0 / np.maximum(variances, 1e-300)
    return max(excess_scatter(sizes, w) / max(float(w.sum() - (w**2).sum() / w.sum()), 1e-300), 0.0) if len(sizes) > 1 else 0.0
