"""Does a model know how wrong it is: how often the measured torque lies within its 50, 80 and 95 % intervals, and how wide they are.

    covered_p = share of rows and joints with |tau - model| <= z_p std,    z = 0.674, 1.282, 1.960
    width     = sum std / sum |tau|                                          of held-out rows, and of fitted ones
"""

from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LEVELS = (0.5, 0.8, 0.95)


@final
@dataclass(frozen=True, eq=False)
class Coverage:
    """Sums over rows and joints that add up over recordings."""

    inside: Array  # (levels,)
    rows: int
    std: float  # N m
    torque: float  # N m

    def __add__(self, other: "Coverage") -> "Coverage":
        return Coverage(self.inside + other.inside, self.rows + other.rows, self.std + other.std, self.torque + other.torque)

    @staticmethod
    def of(measured: Array, modelled: Array, std: Array) -> "Coverage":
        """Return the sums for torques and standard deviations (n, joints) N m."""
        away = np.abs(measured - modelled) / np.maximum(std, 1e-300)
        inside = np.array([float((away <= NormalDist().inv_cdf(0.5 + level / 2)).sum()) for level in LEVELS])
        return Coverage(inside, measured.size, float(std.sum()), float(np.abs(measured).sum()))

    @property
    def width(self) -> float:
        """Mean standard deviation over mean torque."""
        return self.std / self.torque if self.torque > 0 else 0.0

    def shares(self) -> dict[str, float]:
        """Return {"50": share, ...}."""
        return {f"{100 * level:.0f}": float(n) / max(self.rows, 1) for level, n in zip(LEVELS, self.inside, strict=True)}


def coverage_document(held_out: Coverage, fitted: Coverage | None) -> dict[str, Any]:
    """Return what benchmark.json says: shares, relative width, and how much wider it is than on fitted recordings."""
    document: dict[str, Any] = {"shares": held_out.shares(), "width": held_out.width}
    if fitted is not None and fitted.width > 0:
        document["wider_than_fitted"] = held_out.width / fitted.width
    return document
