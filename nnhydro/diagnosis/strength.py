"""How likely the two locks of the diagnosis open for an effect of a given strength: from where its visible torque lies, without any fit.

    U_b = lambda e_b + sqrt(c e_b) xi_b,   xi ~ N(0, 1),   lambda = ||S^-1/2 (I - P_Y) x beta||,   sum_b e_b = 1

U_b is the score of block b in units of its noise, e_b the share of the visible energy that lies in the block, c >= 1 how much noisier
sums of rows are than those of independent rows. Draws of U go through the locks themselves: the family-wise threshold on scores and signed
ranks, the left-out gain of each recording, the materiality.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.locks import MATERIAL, MISMATCH_TESTS, P_BLOCK, P_LEFT_OUT, SOFT, TRIED, VIOLENT
from nnhydro.diagnosis.own import nearness

Array = NDArray[np.float64]
DRAWS = 200
WANTED = 0.8  # chance with which an effect of the stated size is found
SIGMAS = 0.84  # standard deviations of a normal that WANTED lies above its mean
FEWEST = 4  # recordings in which an effect must show before signs can testify
ALL_SIGNS = 8  # recordings up to which all signs are tried; more are nearly normal
NORMAL = 1.645  # quantile of P_LEFT_OUT
STRONGEST = 1e4  # lambda: what is not found there is not found at all


@final
@dataclass(frozen=True, eq=False)
class Where:
    """Where an effect's visible torque lies: shares `e` (blocks,) of its energy, `unit` (blocks,), the share at its strongest joint."""

    e: Array
    unit: NDArray[np.int64]
    strongest: float  # share of the energy at the joint that shows it best
    rows: float  # rows of the campaign at that joint
    correlation: float = 1.0  # c, variance of a sum of noise rows over that of independent ones


@final
@dataclass(frozen=True)
class Price:
    """What stands against an effect: the family-wise threshold of a score, its number of columns, and the price of columns and grid."""

    threshold: float
    width: int
    points: float


def _ranked(U: Array) -> Array:
    """Signed ranks (draws, blocks) of the scores."""
    order = np.argsort(np.argsort(np.abs(U), axis=1), axis=1) + 1.0
    return np.asarray(np.sign(U) * order * (U != 0))


def _standardised_sum(x: Array) -> Array:
    return np.asarray(np.abs(x.sum(axis=1)) / np.maximum(np.sqrt((x**2).sum(axis=1)), 1e-300))


def _gains(U: Array, where: Where, width: int) -> Array:
    """Left-out gain (draws, units) of each recording that shows the effect, its value fitted to all others."""
    units = int(where.unit.max()) + 1
    member = (where.unit[:, None] == np.arange(units)).astype(float)
    u, e = U @ member, where.e @ member
    value = (u.sum(axis=1, keepdims=True) - u) / np.maximum(e.sum() - e, 1e-12)
    shown = e > 1e-9
    return np.asarray(value * u - 0.5 * value**2 * e - where.correlation * (width - 1) / (2 * max(shown.sum() - 1, 1)))[:, shown]


def _better_left_out(gains: Array) -> NDArray[np.bool_]:
    """Whether the sign-flip test on the gains (draws, units) opens the second lock."""
    n = gains.shape[1]
    if n < FEWEST:
        return np.zeros(len(gains), dtype=bool)
    most = VIOLENT * np.median(np.abs(gains), axis=1, keepdims=True)
    cut = np.clip(gains, -most, most)
    if n > ALL_SIGNS:
        return np.asarray(cut.sum(axis=1) >= NORMAL * np.sqrt((cut**2).sum(axis=1)))
    signs = 1.0 - 2.0 * ((np.arange(2**n)[:, None] >> np.arange(n)) & 1)
    total = cut.sum(axis=1, keepdims=True)
    return np.asarray((cut @ signs.T >= total - 1e-9 * most).mean(axis=1) <= P_LEFT_OUT)


def chance(strength: float, where: Where, price: Price, seed: int = 0) -> float:
    """Return the chance that both locks open at `strength` lambda, and that what is gained is material and worth its price.

    Lock 1 is asked by its blocks alone: that left-out likelihood opens it, too, makes what few blocks show visible a little earlier.
    """
    xi = np.random.default_rng(seed).standard_normal((DRAWS, len(where.e)))
    U = strength * where.e + np.sqrt(where.correlation * where.e) * xi
    U[:, where.e <= 0] = 0.0
    seen = np.maximum(_standardised_sum(U), _standardised_sum(_ranked(U)))
    gains = _gains(U, where, price.width)
    whole = gains.sum(axis=1)
    share = 2 * whole * where.strongest / (where.rows + 2 * np.maximum(whole, 0.0) * where.strongest)
    return float(((seen >= price.threshold) & _better_left_out(gains) & (share >= MATERIAL) & (whole > price.points)).mean())


def smallest_strength(where: Where, price: Price) -> float | None:
    """Return the lambda that is found with a chance of 0.8; None where no strength is."""
    low, high = 1.0, STRONGEST
    if chance(high, where, price) < WANTED:
        return None
    while high / low > 1.02:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if chance(middle, where, price) >= WANTED else (middle, high)
    return high


def _own_gains(strength: float, where: Where, values: int) -> Array:
    """Mean gain (units,) of each recording when each block of it is predicted by the values that its other blocks teach."""
    taught = strength**2 / max(values, 1) * (nearness(where.unit) @ where.e)
    told = taught / (1 + taught) if values else np.ones_like(taught)
    return np.asarray(np.bincount(where.unit, strength**2 / 2 * where.e * told), np.float64)


def smallest_own_strength(where: Where, values: int) -> float | None:
    """Return the lambda at which an effect with `values` of each recording's own is found with a chance of 0.8.

        sum_b g_b - 0.84 sqrt(c) lambda = 6 log(3 N / 0.01),    N = locks.TRIED,    g_b = e_b lambda^2 / 2 * h_b / (1 + h_b)
        h_b = lambda^2 / values * sum_b' w_bb' e_b'  over the other blocks of the recording, w their nearness
        and without the recording that shows most  >= 6 log(1 / 0.05)           (see `locks.gain_p`, `locks.confirmed`)

    Source: what a normal value of spread 1 that is told with information h leaves unknown, 1 / (1 + h).
    """
    spread = SIGMAS * np.sqrt(where.correlation)
    shares = np.bincount(where.unit, where.e)
    needed, confirming = SOFT * np.log(MISMATCH_TESTS * TRIED / P_BLOCK), SOFT * np.log(1 / P_LEFT_OUT)

    def enough(strength: float) -> bool:
        gains, rest = _own_gains(strength, where, values), np.arange(len(shares)) != shares.argmax()
        return bool(gains.sum() - spread * strength >= needed
                    and gains[rest].sum() - spread * strength * np.sqrt(shares[rest].sum()) >= confirming)

    low, high = 1.0, STRONGEST
    if (shares > 1e-9).sum() < 2 or not enough(high):
        return None
    while high / low > 1 + 1e-9:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high
