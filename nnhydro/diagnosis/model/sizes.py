"""The sizes tau of the unknown by maximum marginal likelihood.

    tau_jc^2 <- tau_jc^2 sum (eta / t)^2 / sum (1 - var)      over the coefficients of group c at joint j          (MacKay)

The evidence is then integrated over the sizes (eq. 4.16): of a group that explains little, the best size is known badly.
It has several maxima ("all of it is unknown", "all of it is law"): it is climbed from the sizes given and from very small ones,
and the better is taken. Source: MacKay (1992), Neural Computation 4, eq. 4.14.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import SMALLEST_SIZE
from nnhydro.diagnosis.model.evidence import Columns, Posterior, WhiteRows, posterior

Array = NDArray[np.float64]
LARGEST = 3.0  # largest size of the unknown in rms torques
UPDATES = 6  # most iterations of the unknown's sizes


@final
@dataclass(frozen=True, eq=False)
class Sizes:
    """The unknown's sizes `tau` (joints, groups) in shares of each joint's torque."""

    tau: Array

    def times(self, factor: float) -> "Sizes":
        """Return these sizes times `factor`, not below the smallest."""
        return Sizes(np.maximum(self.tau * factor, SMALLEST_SIZE))

    @staticmethod
    def even(whitened: WhiteRows, value: float) -> "Sizes":
        """Return the same size everywhere."""
        return Sizes(np.full((whitened.joints, len(whitened.unknown.names)), value))

    def vector(self, whitened: WhiteRows) -> Array:
        """Return the prior standard deviations (P,) of baseline and unknown; a group of the smallest size is absent."""
        u, r = whitened.unknown, whitened.design.scale
        present = np.where(self.tau > SMALLEST_SIZE, self.tau, 0.0)
        parts = [present[j, u.group] * u.s * r[j] for j in range(whitened.joints)] if whitened.m else []
        return np.concatenate([np.ones(whitened.p), *parts])


def _update(whitened: WhiteRows, fit: Posterior, sizes: Sizes) -> Sizes:
    tau = sizes.tau.copy()
    spread = fit.variances()
    u = whitened.unknown
    for j in range(whitened.joints):
        at = slice(whitened.p + j * whitened.m, whitened.p + (j + 1) * whitened.m)
        scale = fit.scale[at]
        e2 = np.where(scale > 0, (fit.mean[at] / np.where(scale > 0, scale, 1.0)) ** 2, 0.0)
        gamma = 1.0 - spread[at]
        top, below = (np.bincount(u.group, x, len(u.names)) for x in (e2, gamma))
        live = tau[j] > SMALLEST_SIZE
        tau[j, live] *= np.sqrt((top[live] + 1e-9) / np.maximum(below[live], 1e-9))
    return Sizes(np.clip(tau, SMALLEST_SIZE, LARGEST))


def fit_sizes(whitened: WhiteRows, columns: Columns | None, start: Sizes, updates: int = UPDATES) -> tuple[Posterior, Sizes]:
    """Return the fit of `columns` with the sizes that maximise its evidence, climbed from `start`."""
    best: tuple[Posterior, Sizes] | None = None
    sizes = start
    for step in range(updates + 1):
        fit = posterior(whitened, columns, sizes.vector(whitened))
        if best is None or fit.log_evidence > best[0].log_evidence:
            gained = np.inf if best is None else fit.log_evidence - best[0].log_evidence
            best = fit, sizes
            if gained < 0.05:
                break
        elif step > 2:
            break
        if step < updates and whitened.m:
            sizes = _update(whitened, fit, sizes)
        elif not whitened.m:
            break
    assert best is not None
    return best


def nats_of_sizes(whitened: WhiteRows, fit: Posterior, sizes: Sizes) -> float:
    """Return by how many nats the evidence falls if it is integrated over the sizes, which nobody knows beforehand.

        sum_c min(log log(LARGEST / SMALLEST_SIZE) + log(gamma_c / pi) / 2, log p(eta_c = 0) - log p(eta_c = 0 | y))

    c: the groups that are present; gamma_c = sum (1 - var), the coefficients that the data determine. The first is the width of a flat
    prior of log tau over that of its posterior, (2 gamma)^-1/2 (2 pi)^1/2; the second, the nats that the group gains, is the most.
    Source: MacKay (1992), Neural Computation 4, eq. 4.16; Savage-Dickey ratio, Dickey (1971), Ann. Math. Stat. 42.
    """
    u, lost = whitened.unknown, 0.0
    present = np.argwhere(sizes.tau > SMALLEST_SIZE)
    if not len(present):
        return 0.0
    at = [whitened.p + j * whitened.m + np.flatnonzero(u.group == c) for j, c in present]
    covariance = fit.covariance(np.concatenate(at))
    ends = np.cumsum([0, *map(len, at)]).tolist()
    for which, (start, stop) in zip(at, pairwise(ends), strict=True):
        scale = fit.scale[which]
        S = covariance[start:stop, start:stop] / scale[:, None] / scale
        eta = fit.mean[which] / scale
        gamma = max(float((1 - np.diag(S)).sum()), 1e-9)
        gained = (float(np.linalg.slogdet(S)[1]) + float(eta @ np.linalg.solve(S, eta))) / 2
        width = float(np.log(np.log(LARGEST / SMALLEST_SIZE)) + np.log(gamma / np.pi) / 2)
        lost += min(max(width, 0.0), max(gained, 0.0))
    return lost


def without_unknown(whitened: WhiteRows, columns: Columns | None) -> Posterior:
    """Return the fit of `columns` with the unknown switched off."""
    return posterior(whitened, columns, none(whitened).vector(whitened))


def none(whitened: WhiteRows) -> Sizes:
    """Return the unknown switched off."""
    return Sizes.even(whitened, SMALLEST_SIZE)
