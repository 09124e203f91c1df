"""Left-out score of a set of columns: how well recordings are predicted by what the others taught.

    D_uj  squared error of unit u at joint j, in units of the noise, of the fit to all other units
    score = sum_u sum_j n_uj / 2 log max(D_uj / n_uj, 0.8)  +  |z|^2 / 2

The logarithm makes a hypothesis reach the noise floor everywhere; on the squared error a flexible wrong one wins by shaving the worst
recording. z are the baseline's parameters in standard deviations of what is known of them: moving a mass by twenty of them has its price.
Lower is better. Source: diagnosis by likelihood of left-out recordings, ours.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.blocks import Blocks

Array = NDArray[np.float64]
FLOOR = 0.8  # of the noise energy: what lies below is chance, not merit
RIDGE = 1e-8  # relative to a column's own energy: keeps aliased columns solvable


@final
@dataclass(frozen=True, eq=False)
class Scored:
    """A set's left-out performance: `energy` D (units, joints), `by_unit` score (units,), `total`, `theta` of the fit to all, its cost."""

    energy: Array
    by_unit: Array
    total: float
    theta: Array


@final
@dataclass(frozen=True, eq=False)
class Bench:
    """Unit sums with noise weights: everything that scores need. `prior` (p,) precision of the baseline's parameters (0: free)."""

    G: Array  # (units, joints, P, P), weighted by 1/noise^2 of the joint
    n: Array  # (units,)
    p: int
    prior: Array  # (p,)

    @staticmethod
    def of(blocks: Blocks, noise: Array, prior: Array) -> "Bench":
        """Return the bench for joint noises (joints,) N m."""
        G, n = blocks.by_unit()
        return Bench(G / noise[None, :, None, None] ** 2, n, blocks.p, prior)

    def index(self, columns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return positions of baseline and of candidate `columns` in the Gram matrices."""
        result: NDArray[np.int64] = np.concatenate([np.arange(self.p), self.p + columns])
        return result

    def scored(self, columns: NDArray[np.int64]) -> Scored:
        """Return the left-out score with the candidate `columns` beside the baseline."""
        take = self.index(columns)
        H = self.G[:, :, take[:, None], take[None, :]]
        g = self.G[:, :, take, -1]
        s = self.G[:, :, -1, -1]
        Hu, gu = H.sum(axis=1), g.sum(axis=1)  # (units, q, q), (units, q)
        total, gt = Hu.sum(axis=0), gu.sum(axis=0)
        penalty = np.concatenate([self.prior, np.zeros(len(columns))]) + RIDGE * np.diag(total) + 1e-12
        A = total + np.diag(penalty)
        theta = np.linalg.solve(A, gt)
        left_out = np.linalg.solve(A[None] - Hu, (gt - gu)[..., None])[..., 0]  # (units, q)
        energy = s - 2 * np.einsum("ujq,uq->uj", g, left_out) + np.einsum("uq,ujqr,ur->uj", left_out, H, left_out, optimize=True)
        n = self.n[:, None]
        by_unit = (n / 2 * np.log(np.maximum(energy / n, FLOOR))).sum(axis=1)
        cost = 0.5 * float((self.prior * theta[: self.p] ** 2).sum())
        return Scored(energy, by_unit, float(by_unit.sum()) + cost, theta)
