"""Values of each recording's own, a phase or an offset, as random effects: how far they spread over recordings is learned from all.

    a_u ~ N(0, diag v),   y_u = Y_u theta + X_u a_u + e_u,   E(a_u | y_u) = (X_u'X_u + 1/v)^-1 X_u'(y_u - Y_u theta)

all in units of the noise. The spreads v are those under which the recordings together are likeliest, by expectation and maximisation. They
hold a value that few rows tell, or a pair of alike columns, to what the others are like; a fit alone would take any value.
Source: Dempster, Laird and Rubin (1977), J. R. Stat. Soc. B 39, section 4.4.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STEPS = 8  # of expectation and maximisation; what matters is the spread's order of magnitude
FLAT = 1e-3  # of a column's mean energy a unit: the precision from which they start


def nearness(unit: Index) -> Array:
    """Return the weight (blocks, blocks) of each other block of the same `unit` (blocks,): neighbours count most, as no phase lasts."""
    apart = np.abs(np.arange(len(unit))[:, None] - np.arange(len(unit))[None, :])
    result: Array = np.where((unit[:, None] == unit[None, :]) & (apart > 0), np.exp(-1.0 * (apart - 1)), 0.0)
    return result


@final
@dataclass(frozen=True, eq=False)
class Effects:
    """Gram matrices `G` (units, P, P) over joints, the places `take` (q,) of common columns and `own` (o,), the spreads `v` (o,)."""

    G: Array
    take: Index
    own: Index
    v: Array

    @staticmethod
    def of(G: Array, take: Index, own: Index, penalty: Array) -> "Effects":
        """Return the effects with the likeliest spreads; `penalty` (q, q) is added to the common columns' Gram matrix."""
        size = np.einsum("ukk->k", G[:, own[:, None], own[None, :]]) / len(G)
        made = Effects(G, take, own, 1 / (FLAT * size + 1e-12))
        for _ in range(STEPS if len(own) else 0):
            H, g = made.eliminated()
            theta = np.linalg.solve(H.sum(axis=0) + penalty, g.sum(axis=0))
            mean = made.values(theta)
            spread = (mean**2).mean(axis=0) + np.einsum("ukk->k", made.covariance) / len(G)
            made = Effects(G, take, own, np.maximum(spread, 1e-300))
        return made

    @property
    def covariance(self) -> Array:
        """The covariances (units, o, o) of the values."""
        return np.asarray(np.linalg.inv(self.G[:, self.own[:, None], self.own[None, :]] + np.diag(1 / self.v)), np.float64)

    def eliminated(self) -> tuple[Array, Array]:
        """Return the common columns' Gram matrices (units, q, q) and products with the torque (units, q), own values integrated over."""
        H, g = self.G[:, self.take[:, None], self.take[None, :]], self.G[:, self.take, -1]
        if not len(self.own):
            return H, g
        C = self.G[:, self.take[:, None], self.own[None, :]] @ self.covariance
        g = np.asarray(g - (C @ self.G[:, self.own, -1][..., None])[..., 0], np.float64)
        return H - C @ self.G[:, self.own[:, None], self.take[None, :]], g

    def values(self, theta: Array) -> Array:
        """Return the likeliest values (units, o) beside the common parameters `theta` (q,) or (units, q)."""
        theta = np.broadcast_to(theta, (len(self.G), len(self.take)))
        left = self.G[:, self.own, -1] - (self.G[:, self.own[:, None], self.take[None, :]] @ theta[..., None])[..., 0]
        return np.asarray((self.covariance @ left[..., None])[..., 0], np.float64)
