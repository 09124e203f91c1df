"""The prior of an effect's size: of which order of magnitude it is nobody knows before, from RHO of the torque down to RELEVANT.

    beta ~ N(0, rho^2),     rho the most probable of RHO, RHO / 10, ... not below RELEVANT

as the unknown's sizes are the most probable ones. Fits are made at RHO; the size comes in afterwards. With a prior of one width a small
effect would be improbable for its size alone, beside an unknown whose size is free. Effects with values of each recording's own keep RHO:
noise that changes with the motion would pass for small ones.
Source: type-II maximum likelihood, MacKay (1992), Neural Computation 4.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import RELEVANT, RHO

Array = NDArray[np.float64]
SIZES = tuple(RHO / 10**k for k in range(1 + int(np.floor(np.log10(RHO / RELEVANT) + 1e-9))))


def gain_of(R: Array, c: Array, sizes: Sequence[float] = SIZES) -> Array:
    """Return the log evidence (..., m) that columns with projected Gram matrix R (..., k, k) and products c (..., k, m) add.

        max_rho [rho^2 c'(1 + rho^2 R)^-1 c - log|1 + rho^2 R|] / 2
    """
    logs = []
    for rho in sizes:
        M = rho**2 * R + np.eye(R.shape[-1])
        logs.append(0.5 * (rho**2 * (c * np.linalg.solve(M, c)).sum(axis=-2) - np.linalg.slogdet(M)[1][..., None]))
    made: Array = np.max(logs, axis=0)
    return made


def size_and_bonus(mean: Array, covariance: Array) -> tuple[float, float]:
    """Return the most probable size rho of an effect of posterior N(mean, covariance) under RHO, and what the log evidence gains by it.

        max_rho log s^-k |1 + a C|^-1/2 exp(-a m'(1 + a C)^-1 m / 2),   s = rho / RHO,  a = rho^-2 - RHO^-2
    """
    k, logs = len(mean), []
    for rho in SIZES:
        a = rho**-2 - RHO**-2
        M = np.eye(k) + a * covariance
        logs.append(-k * np.log(rho / RHO) - 0.5 * (float(np.linalg.slogdet(M)[1]) + a * float(mean @ np.linalg.solve(M, mean))))
    best = int(np.argmax(logs))
    return SIZES[best], float(logs[best])
