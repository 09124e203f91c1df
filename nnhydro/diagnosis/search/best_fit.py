"""The fit whose values are reported: a set without the unknown, each row weighted by the noise that this set leaves.

The noise is estimated as in noise.spectrum, beside this very set and from white noise on: the fit starts from least squares. A spectrum
estimated beside a poorer fit would treat its misfit at low frequencies as noise for good.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.model.evidence import Columns, Posterior, WhiteRows
from nnhydro.diagnosis.model.sizes import none, without_unknown
from nnhydro.diagnosis.noise.spectrum import Noise, reestimate, white_noise, with_form_error
from nnhydro.diagnosis.problem.free_machines import scale_factor
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ROUNDS = 4  # iterations of the weights


@final
@dataclass(frozen=True, eq=False)
class BestFit:
    """The fit of a set without the unknown: rows and columns whitened by its noise; `coefficients`: numbers of baseline and laws in it."""

    whitened: WhiteRows
    columns: Columns | None
    posterior: Posterior
    coefficients: Index
    weight: Array  # (k,) shares of the weight that the columns hold; 0 where something is driven

    @staticmethod
    def of(whitened: WhiteRows, columns: Columns | None, weight: Array) -> "BestFit":
        """Return the fit of `columns`, which hold the shares `weight` of the weight, beside the baseline."""
        fit = without_unknown(whitened, columns)
        named = np.concatenate([np.arange(whitened.p), np.arange(len(whitened.b), len(fit.scale))])
        return BestFit(whitened, columns, fit, named, weight)

    def with_columns(self, columns: Columns) -> "BestFit":
        """Return the fit of `columns`, which hold those of this one, over the same noise."""
        return BestFit.of(self.whitened, columns, self.weight)

    @cached_property
    def rows(self) -> Array:
        """The whitened columns (n, joints, k) of baseline and laws."""
        return self.whitened.Y if self.columns is None else np.concatenate([self.whitened.Y, self.columns.Xw], axis=2)

    @cached_property
    def residual(self) -> Array:
        """What the fit leaves, whitened (n, joints)."""
        left: Array = self.whitened.y - self.rows @ self.posterior.mean[self.coefficients]
        return left

    @cached_property
    def scale_factor(self) -> float:
        """The factor up to which the equation of motion holds: values over it are those of the machine. 1 where something is driven."""
        laws = self.posterior.mean[self.coefficients[self.whitened.p:]]
        return scale_factor(self.weight, laws[: len(self.weight)])

    @property
    def z(self) -> Array:
        """The baseline's parameters (p,)."""
        made: Array = self.posterior.mean[: self.whitened.p] / self.scale_factor
        return made


def fit_at(search: Search, found: ScoredSet, v: Array) -> BestFit:
    """Return the fit of `found` without the unknown where the noise of every row is `v` (n, joints)."""
    return BestFit.of(*_weigh(search, found, v), _shares_of_model(search, found))


def _weigh(search: Search, found: ScoredSet, v: Array) -> tuple[WhiteRows, Columns | None]:
    """Return the rows and the columns of `found` weighed by the noise `v` (n, joints)."""
    old, X = search.view.whitened, search.view.join(found.chosen)
    whitened = WhiteRows(old.design, old.unknown, v)
    return whitened, None if X is None else Columns.of(whitened, whitened.weigh(X.Xw / old.sw[..., None]))


def reestimate_noise(search: Search, found: ScoredSet, noise: Noise) -> Noise:
    """Return the noise beside `found` and its unknown; an error of FORM in what is explained is no noise.

    Tables keep the `noise` of the search: their few rows scatter by less than FORM, and nothing would be left as noise.
    """
    design = search.whitened.design
    if (design.problem.frequency < 0).all():
        return noise
    made = with_form_error(design, noise)
    for _ in range(ROUNDS):
        whitened, columns = _weigh(search, found, made.v)
        made = reestimate(design, made, whitened, columns, found.sizes.vector(whitened))
    return replace(made, numerics=noise.numerics)


def _shares_of_model(search: Search, found: ScoredSet) -> Array:
    """The shares of the model (k,) that the scaled columns of a set hold; a phase per recording carries none."""
    library = search.view.library
    parts = [np.zeros(search.view.columns(k).Xw.shape[2]) if library.hypotheses[k].per_recording or not library.design.undriven else
             library.design.shares_of_model([library.hypotheses[k]]) * library.scale[library.at(k)] for k in found.chosen]
    return np.concatenate([np.zeros(0), *parts])


def best_fit(search: Search, found: ScoredSet) -> BestFit:
    """Return the fit of `found` whose values are reported; it is computed once for each set."""
    if found.chosen not in search.best_fits:
        design = search.view.library.design
        noise = white_noise(design)
        for _ in range(ROUNDS):
            fit = fit_at(search, found, noise.v)
            noise = reestimate(design, noise, fit.whitened, fit.columns, none(fit.whitened).vector(fit.whitened))
        search.best_fits[found.chosen] = fit_at(search, found, noise.v)
    return search.best_fits[found.chosen]


def remainder_without_unknown(search: Search, found: ScoredSet) -> Array:
    """Return what the fit of a set without the unknown leaves of the torque, divided by the noise, (n, joints)."""
    whitened, columns = search.whitened, search.view.join(found.chosen)
    fit = without_unknown(whitened, columns)
    left: Array = whitened.y - whitened.Y @ fit.mean[: whitened.p]
    return left if columns is None else left - columns.Xw @ fit.mean[len(whitened.b):]
