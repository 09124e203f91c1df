"""Values of the members of a set and their covariance, in the units of their effects.

Values are those of the fit without the unknown: the unknown is what is orthogonal to the named effects and must not take from their size.
The covariance holds the posterior's spread and the change of the values beside the unknown.
Source: orthogonal discrepancy, Plumlee (2017), J. Am. Stat. Assoc. 112.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.model.evidence import posterior
from nnhydro.diagnosis.model.sizes import none
from nnhydro.diagnosis.search.stepwise import Scored, Search

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Values:
    """Linear values (p,) of a member in its units and their covariance (p, p)."""

    mean: Array
    covariance: Array
    bounded: bool = False  # whether a value was cut at a physical bound other than 0


def values_of(search: Search, found: Scored, k: int) -> Values:
    """Return the values of member `k`: without the unknown, the spread widened by what changes beside it."""
    view, library = search.view, search.view.library
    columns = view.joined(found.chosen)
    fit = posterior(view.whitened, columns, none(view.whitened).vector(view.whitened))
    at, h = found.places(view)[k], library.hypotheses[k]
    index = np.arange(at.start, at.stop)
    covariance = fit.covariance(index) + np.diag((found.fit.mean[at] - fit.mean[at]) ** 2)
    mean = fit.mean[at]
    if h.per_recording:
        mean, covariance = _pooled(mean.reshape(-1, h.width), covariance, h.width)
    low, high = library.bounds(k)
    scale = library.scale[library.at(k)]
    bounded = bool(np.any(((mean > high) & (high != 0)) | ((mean < low) & (low != 0))))
    return Values(np.clip(mean, low, high) * scale, covariance * scale[:, None] * scale, bounded)


def _pooled(beta: Array, covariance: Array, width: int) -> tuple[Array, Array]:
    """The rms (width,) over recordings of values of each recording's own, and its covariance."""
    rms = np.sqrt((beta**2).mean(axis=0))
    variances = np.diag(covariance).reshape(-1, width)
    count = len(beta)
    spread = (beta**2 * variances).sum(axis=0) / np.maximum(count**2 * rms**2, 1e-300)
    return rms, np.diag(spread)
