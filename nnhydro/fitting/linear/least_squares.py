"""Weighted linear least squares with Gaussian priors and bounds, from sufficient statistics.

    theta = argmin  sum_j |tau_j - X_j theta|^2 / (s_j^2 k_j)  +  |z|^2,     theta = mean + F z

    s_j   rms residual at joint j, found by iterating
    k_j   correlation time of that residual in samples: so many samples count as one piece of evidence. Without it ten thousand
          autocorrelated samples would overrule a scale that weighed the link.

Intervals: bootstrap over recordings (blocks), which is honest where residuals are autocorrelated. Source: ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.fitting.linear.prior import Prior
from nnhydro.fitting.linear.statistics import Statistics, residual_energy, weight_joints

Array = NDArray[np.float64]
ROUNDS = 4  # reweighting settles to 1 % in two or three
# residual relative to the torque below which a joint counts as fitted exactly: with less, the rounding of the sums outweighs the prior
# along directions that the motions do not excite, and masses drift by many times what is known of them
NOISELESS = 1e-6


@final
@dataclass(frozen=True, eq=False)
class Solution:
    """A fitted parameter vector with what is needed to judge it."""

    theta: Array  # (p,)
    covariance: Array  # (p, p) posterior, Gaussian approximation
    weight: Array  # (joints,) 1/(s^2 k)
    rms: Array  # (joints,) N m residual
    at_bound: NDArray[np.bool_]  # (r,) directions that ended on a bound
    condition: float  # of the scaled normal matrix
    last_change: float = 0.0  # of the rms residual in the last round of reweighting, relative; the largest over the joints


def ridge(A: Array, y: Array) -> Array:
    """Return the values (A'A + 1)^-1 A'y (p, ...) of columns A (n, p), each N(0, 1) beforehand, beside noise of unit size in y (n, ...)."""
    values: Array = np.asarray(np.linalg.solve(A.T @ A + np.eye(A.shape[1]), A.T @ y), dtype=float)
    return values


def solve(stats: Statistics, prior: Prior, weight: Array) -> Solution:
    """Return the penalised solution for given joint weights (joints,) 1/(N m)^2; parameters (p,) as `prior` orders them."""
    from scipy.optimize import lsq_linear

    H, g = weight_joints(stats, weight)
    A = prior.F.T @ H @ prior.F + np.eye(prior.F.shape[1])
    b = prior.F.T @ (g - H @ prior.mean)
    z = np.linalg.solve(A, b) if len(b) else b
    outside = (z < prior.lowest) | (z > prior.highest)
    if outside.any():
        R = np.linalg.cholesky(A).T
        z = lsq_linear(R, np.linalg.solve(R.T, b), (prior.lowest, prior.highest), method="bvls").x
    at_bound = (z <= prior.lowest + 1e-9) | (z >= prior.highest - 1e-9)
    scale = 1 / np.sqrt(np.diag(A))
    theta = prior.mean + prior.F @ z
    covariance = prior.F @ np.linalg.inv(A) @ prior.F.T if len(b) else np.zeros_like(H)
    rms = np.sqrt(residual_energy(stats, theta) / np.maximum(stats.n, 1))
    condition = float(np.linalg.cond(A * np.outer(scale, scale))) if len(b) else 1.0
    return Solution(theta, covariance, weight, rms, at_bound, condition)


def joint_weights(stats: Statistics, prior: Prior, rms: Array, correlation: Array) -> Array:
    """Return 1/(s^2 k) (joints,) for residuals of `rms` (joints,) N m and correlation times (joints,) in samples.

    The torque that a residual is held against is the measured one, or the one expected beforehand where that is larger: a channel that
    reads nothing, or in another unit, is no exact measurement.
    """
    expected = np.einsum("p,jpq,q->j", prior.mean, stats.H, prior.mean)
    floor = NOISELESS * np.sqrt(np.maximum(np.maximum(stats.s, expected) / np.maximum(stats.n, 1), 1e-24))
    result: Array = 1 / (np.maximum(rms, np.maximum(floor, 1e-12)) ** 2 * np.maximum(correlation, 1.0))
    return result


def fit(stats: Statistics, prior: Prior, correlation: Array) -> Solution:
    """Return the solution with joint weights iterated to the residuals; `correlation` (joints,) in samples."""
    rms = np.sqrt(np.maximum(stats.s, 1e-24) / np.maximum(stats.n, 1))
    for _ in range(ROUNDS):
        before = rms
        solution = solve(stats, prior, joint_weights(stats, prior, rms, correlation))
        rms = solution.rms
    return replace(solution, last_change=float(np.max(np.abs(rms - before) / np.maximum(before, 1e-12))))


def bootstrap(blocks: Sequence[Statistics], prior: Prior, weight: Array, draws: int, seed: int) -> Array:
    """Return parameters (draws, p) refitted to blocks drawn with replacement, weights kept.

    Each draw also moves the prior's centre by its own standard deviation, so that what the recordings do not tell keeps its uncertainty.
    """
    rng = np.random.default_rng(seed)
    H, g = (np.stack(x) for x in zip(*(weight_joints(block, weight) for block in blocks), strict=True))
    identity = np.eye(prior.F.shape[1])
    result = np.empty((draws, len(prior.mean)))
    for draw in range(draws):
        times = np.bincount(rng.integers(0, len(blocks), len(blocks)), minlength=len(blocks)).astype(float)
        Hd, gd = np.tensordot(times, H, 1), times @ g
        rhs = prior.F.T @ (gd - Hd @ prior.mean) + rng.standard_normal(len(identity))
        z = np.linalg.solve(prior.F.T @ Hd @ prior.F + identity, rhs) if len(identity) else np.zeros(0)
        result[draw] = prior.mean + prior.F @ np.clip(z, prior.lowest, prior.highest)
    return result


def correlation_time(residual: Array) -> float:
    """Return the integrated autocorrelation time of `residual` (n,) in samples, 1 for white noise (Sokal's window)."""
    n = len(residual)
    x = residual - residual.mean()
    if n < 8 or not x.any():
        return 1.0
    power = np.abs(np.fft.rfft(x, 2 * n)) ** 2
    rho = np.fft.irfft(power)[: n // 2]
    rho = rho / rho[0]
    times = 2 * np.cumsum(rho) - 1
    window = np.flatnonzero(np.arange(len(times)) >= 5 * times)
    return float(max(times[window[0]] if len(window) else times[-1], 1.0))


