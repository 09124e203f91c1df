"""How much the uncertainty of the baseline's parameters adds to that of an instrument effect's values.

    C -> C + sum_i d_i d_i',   d_i = argmin_b |X(z + v_i) b - X(z) beta| - beta,   sum_i v_i v_i' the posterior covariance of z

Columns of loads do not depend on the baseline; those of instruments do. Example: a wave loads an arm at rest by (1 + C_M) times its size,
and without motion C_M stays unknown.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.problem.hypothesis import Hypothesis
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.effects.effect import InstrumentEffect
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
KNOWN = 0.03  # posterior over prior standard deviation; a baseline parameter known better moves no value that matters


def spread_by_baseline(search: Search, found: ScoredSet, k: int) -> Array:
    """Return the covariance (p, p) of the values of member `k`, in its units, that comes from the baseline's parameters."""
    view, h = search.view, search.view.library.hypotheses[k]
    nothing = np.zeros((h.width, h.width))
    whitened, base = view.whitened, view.library.design.baseline
    if not isinstance(h.effect, InstrumentEffect) or not whitened.p:
        return nothing
    fit = best_fit(search, found).posterior
    z = fit.mean[: whitened.p]
    variances, directions = np.linalg.eigh(fit.covariance(slice(0, whitened.p)))
    unsettled = variances > KNOWN**2
    if not unsettled.any():
        return nothing
    group = view.library.design.problem.group_of
    parts = [group == g for g in view.acting_groups(k)] if h.per_recording else [np.full(len(group), True)]
    beta = fit.mean[found.places(view)[k]].reshape(-1, h.width) * view.library.scale[view.library.at(k)]

    def columns(model: StripTheory) -> Array:
        """Return the whitened columns (n, joints, p) of the effect at the reading of `model`, nearly so: only their changes count."""
        reading = None if h.working_model is None or h.values_by_recording else model
        there: Hypothesis = replace(h, values_by_recording={}, working_model=reading, rough=True)
        made: Array = whitened.weigh(view.library.design.columns([there], model))
        return made

    at_mean = columns(base.at(base.within(z)))
    total = nothing
    for variance, direction in zip(variances[unsettled], directions.T[unsettled], strict=True):
        there = columns(base.at(base.within(z + np.sqrt(variance) * direction)))
        moved = np.array([np.linalg.lstsq(there[rows].reshape(-1, h.width), at_mean[rows].reshape(-1, h.width) @ values)[0]
                          for rows, values in zip(parts, beta, strict=True)])
        d = np.sqrt((moved**2).mean(axis=0)) - np.sqrt((beta**2).mean(axis=0)) if h.per_recording else moved[0] - beta[0]
        total = total + np.outer(d, d)
    return total
