"""The prior of an effect's size: of which order of magnitude it is nobody knows before, from RHO of the torque down to RELEVANT.

    beta ~ 1/S sum_s N(0, rho_s^2),     rho_s = RHO, RHO / 10, ... not below RELEVANT

Fits are made at RHO, where the largest effects pay nothing; evidence is that of the mixture. With a prior of one width a small effect, and
one with values of each recording's own, would be improbable for its size alone, beside an unknown whose size is free.
Source: scale mixtures of normals, West (1987), Biometrika 74; log-uniform scale, Jeffreys (1961).
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import RELEVANT, RHO

Array = NDArray[np.float64]
SIZES = tuple(RHO / 10**k for k in range(1 + int(np.floor(np.log10(RHO / RELEVANT) + 1e-9))))


def _mean_evidence(logs: list[Array]) -> Array:
    """Return the logarithm of the mean of exp(logs) over the sizes."""
    made: Array = np.logaddexp.reduce(np.stack(logs), axis=0) - np.log(len(logs))
    return made


def gain_of(R: Array, c: Array) -> Array:
    """Return the log evidence (..., m) that columns with projected Gram matrix R (..., k, k) and products c (..., k, m) add.

        log 1/S sum_s exp{[rho_s^2 c'(1 + rho_s^2 R)^-1 c - log|1 + rho_s^2 R|] / 2}
    """
    logs = []
    for rho in SIZES:
        M = rho**2 * R + np.eye(R.shape[-1])
        logs.append(0.5 * (rho**2 * (c * np.linalg.solve(M, c)).sum(axis=-2) - np.linalg.slogdet(M)[1][..., None]))
    return _mean_evidence(logs)


def _log_ratios(mean: Array, covariance: Array) -> list[Array]:
    """Return how the log evidence changes from the prior N(0, RHO^2) to that of each size, the posterior being N(mean, covariance).

        log s^-k |1 + a_s C|^-1/2 exp(-a_s m'(1 + a_s C)^-1 m / 2),   s = rho_s / RHO,  a_s = rho_s^-2 - RHO^-2
    """
    k, logs = len(mean), []
    for rho in SIZES:
        a = rho**-2 - RHO**-2
        M = np.eye(k) + a * covariance
        logs.append(np.asarray(-k * np.log(rho / RHO) - 0.5 * (np.linalg.slogdet(M)[1] + a * (mean @ np.linalg.solve(M, mean)))))
    return logs


def size_bonus(mean: Array, covariance: Array) -> float:
    """Return how the log evidence changes from the prior N(0, RHO^2) to that of all sizes, the posterior being N(mean, covariance)."""
    return float(_mean_evidence(_log_ratios(mean, covariance)))


def size_of(mean: Array, covariance: Array) -> float:
    """Return the most probable size of an effect whose values have the posterior N(mean, covariance) under RHO."""
    return SIZES[int(np.argmax(_log_ratios(mean, covariance)))]
