"""How far a model's torque is from the measured one: sums over rows that add up over recordings.

    error   = sum |tau - model| / sum |tau|              pooled over joints, rows and recordings
    NRMSE_j = sqrt( sum (tau_j - model_j)^2 / sum tau_j^2 )
    VAF_j   = 1 - var(tau_j - model_j) / var(tau_j)      variance accounted for

Source: McLain & Rock (1998), section 4, footnote 1 (error).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
DRAWS = 1000


@final
@dataclass(frozen=True, eq=False)
class Misfit:
    """Sums (joints,) over the compared rows of one recording or of many."""

    abs_residual: Array
    abs_torque: Array
    sq_residual: Array
    sq_torque: Array
    residual: Array
    torque: Array
    rows: int

    def __add__(self, other: "Misfit") -> "Misfit":
        return Misfit(self.abs_residual + other.abs_residual, self.abs_torque + other.abs_torque, self.sq_residual + other.sq_residual,
                      self.sq_torque + other.sq_torque, self.residual + other.residual, self.torque + other.torque, self.rows + other.rows)

    @staticmethod
    def of(measured: Array, modelled: Array) -> "Misfit":
        """Return the sums for torques (n, joints) N m."""
        r = measured - modelled
        return Misfit(np.abs(r).sum(0), np.abs(measured).sum(0), (r**2).sum(0), (measured**2).sum(0), r.sum(0), measured.sum(0), len(r))

    @staticmethod
    def total(parts: Iterable["Misfit"]) -> "Misfit":
        """Return the sum of at least one misfit."""
        first, *rest = parts
        return sum(rest, start=first)

    @property
    def error(self) -> float:
        """McLain & Rock's pooled relative error; infinite where the measured torque is zero throughout and the model's is not."""
        return _ratio(float(self.abs_residual.sum()), float(self.abs_torque.sum()))

    @property
    def nrmse(self) -> list[float]:
        """Rms residual over rms torque, a joint."""
        return [_ratio(float(a), float(b)) ** 0.5 for a, b in zip(self.sq_residual, self.sq_torque, strict=True)]

    @property
    def vaf(self) -> list[float]:
        """Variance accounted for, a joint."""
        n = max(self.rows, 1)
        left, there = self.sq_residual - self.residual**2 / n, self.sq_torque - self.torque**2 / n
        return [1 - _ratio(float(a), float(b)) for a, b in zip(left, there, strict=True)]


def _ratio(a: float, b: float) -> float:
    return a / b if b > 0 else 0.0 if a == 0 else 1e9  # JSON knows no infinity


def error_interval(parts: Sequence[Misfit], seed: int) -> tuple[float, float]:
    """Return the 95 % interval of the pooled error by bootstrap over recordings."""
    residual = np.array([part.abs_residual.sum() for part in parts])
    torque = np.array([part.abs_torque.sum() for part in parts])
    pick = np.random.default_rng(seed).integers(0, len(parts), (DRAWS, len(parts)))
    ratios = residual[pick].sum(axis=1) / np.maximum(torque[pick].sum(axis=1), 1e-300)
    low, high = np.quantile(np.minimum(ratios, 1e9), [0.025, 0.975])
    return float(low), float(high)


def interval_of_share(hits: int, tries: int, method: Literal["exact", "wilson"] = "exact") -> tuple[float, float]:
    """Return the 95 % interval of the share of `hits` in `tries`; that of no tries is everything.

    Source: "exact", Clopper and Pearson (1934), Biometrika 26; "wilson", Wilson (1927), J. Am. Stat. Assoc. 22.
    """
    from scipy.stats import binomtest

    if not tries:
        return 0.0, 1.0
    low, high = binomtest(hits, tries).proportion_ci(method=method)
    return float(low), float(high)
