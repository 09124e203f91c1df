"""Left-out score of a set of columns: how well recordings are predicted by what the others taught.

    D_uj  squared error of unit u at joint j, in units of the noise, of the fit to all other units
    score = sum_u sum_j n_uj / 2 log max(D_uj / n_uj, 0.8)  +  |z|^2 / 2

The logarithm makes a hypothesis reach the noise floor everywhere; on the squared error a flexible wrong one wins by shaving the worst
recording. z are the baseline's parameters in standard deviations of what is known of them: moving a mass by twenty of them has its price.
Values of their own in every recording (a phase, an offset) are random effects (nnhydro.diagnosis.own): integrated over in the common fit,
and in each block of a recording predicted by what its other blocks and the spread over all recordings taught. Lower is better.
Source: diagnosis by likelihood of left-out recordings, ours.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.blocks import Blocks
from nnhydro.diagnosis.own import Effects, nearness

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FLOOR = 0.8  # of the noise energy: what lies below is chance, not merit
RIDGE = 1e-8  # relative to a column's own energy: keeps aliased columns solvable


@final
@dataclass(frozen=True, eq=False)
class Scored:
    """A set's left-out performance: `energy` D (units, joints), `by_unit` score (units,), `total`, `theta` of the fit to all, its `cost`.

    The cost |z|^2 / 2 is what the fit takes beyond what is known of the baseline's parameters.
    """

    energy: Array
    by_unit: Array
    total: float
    theta: Array
    cost: float


@final
@dataclass(frozen=True, eq=False)
class Bench:
    """Gram sums a block with noise weights: everything that scores need. `prior` (p,) precision of the baseline's parameters (0: free)."""

    blocks: Blocks  # weighted by 1/noise^2 of the joint
    p: int
    prior: Array  # (p,)

    @staticmethod
    def of(blocks: Blocks, noise: Array, prior: Array) -> "Bench":
        """Return the bench for joint noises (joints,) N m."""
        return Bench(Blocks(blocks.G / noise[None, :, None, None] ** 2, blocks.n, blocks.unit, blocks.p), blocks.p, prior)

    @cached_property
    def by_unit(self) -> tuple[Array, Array]:
        """The sums (units, joints, P, P) and rows (units,) a unit."""
        return self.blocks.by_unit()

    @cached_property
    def unit_sums(self) -> Array:
        """The sums (units, P, P) over the joints."""
        result: Array = np.asarray(self.by_unit[0].sum(axis=1), np.float64)
        return result

    @cached_property
    def total(self) -> Array:
        """The sum (P, P) over units and joints."""
        result: Array = np.asarray(self.by_unit[0].sum(axis=(0, 1)), np.float64)
        return result

    @cached_property
    def joint_sums(self) -> Array:
        """The sums (blocks, P, P) over joints."""
        result: Array = self.blocks.G.sum(axis=1)
        return result

    def index(self, columns: Index) -> Index:
        """Return positions of baseline and of candidate `columns` in the Gram matrices."""
        result: Index = np.concatenate([np.arange(self.p), self.p + columns])
        return result

    def penalty(self, take: Index) -> Array:
        """Return the precisions (q,) that fits of the columns at `take` add to the diagonal."""
        result: Array = np.concatenate([self.prior, np.zeros(len(take) - self.p)]) + RIDGE * np.diag(self.total)[take] + 1e-12
        return result

    def left_out(self, take: Index, own: Index) -> tuple[Array, Array]:
        """Return the parameters of the columns at `take` fitted to all units (q,) and to all but each one (units, q)."""
        theta, left_out, _ = self._fitted(take, own)
        return theta, left_out

    def _fitted(self, take: Index, own: Index) -> tuple[Array, Array, Effects]:
        """The parameters fitted to all units, to all but each one, and the values of a recording's own."""
        G, penalty = self.unit_sums, np.diag(self.penalty(take))
        effects = Effects.of(G, take, own, penalty)
        H, g = effects.eliminated()
        A, gt = H.sum(axis=0) + penalty, g.sum(axis=0)
        return np.linalg.solve(A, gt), np.linalg.solve(A[None] - H, (gt - g)[..., None])[..., 0], effects

    def scored(self, columns: Index, own: Index | None = None) -> Scored:
        """Return the left-out score with the candidate `columns` beside the baseline, and `own` with a value in every recording."""
        take, beside = self.index(columns), self.p + (np.zeros(0, np.int64) if own is None else own)
        theta, left_out, effects = self._fitted(take, beside)
        energy = self._energy(take, left_out)
        if len(beside):
            energy = energy - self._own_gains(take, beside, left_out, effects.v)
        energy = np.maximum(energy, 0.0)
        by_unit = self._cost(energy)
        cost = 0.5 * float((self.prior * theta[: self.p] ** 2).sum())
        return Scored(energy, by_unit, float(by_unit.sum()) + cost, theta, cost)

    def _energy(self, take: Index, theta: Array) -> Array:
        """Squared errors (units, joints) of the columns at `take` with the parameters `theta` (units, q)."""
        G = self.by_unit[0]
        H, g, s = G[:, :, take[:, None], take[None, :]], G[:, :, take, -1], G[:, :, -1, -1]
        result: Array = s - 2 * np.einsum("ujq,uq->uj", g, theta) + np.einsum("uq,ujqr,ur->uj", theta, H, theta, optimize=True)
        return result

    def _cost(self, energy: Array) -> Array:
        n = self.by_unit[1][:, None]
        return np.asarray((n / 2 * np.log(np.maximum(energy / n, FLOOR))).sum(axis=1), np.float64)

    @cached_property
    def _near(self) -> Array:
        return nearness(self.blocks.unit)

    def own_values(self, take: Index, own: Index, theta: Array) -> Array:
        """Return the values (blocks, o) of a recording's own columns, each from the other blocks of its unit; `theta` (units, q)."""
        return self._predicted(take, own, theta, self._fitted(take, own)[2].v)

    def _predicted(self, take: Index, own: Index, theta: Array, v: Array) -> Array:
        G, unit, o, q = self.joint_sums, self.blocks.unit, len(own), len(take)
        with_all = G[:, own[:, None], np.concatenate([own, take, [G.shape[2] - 1]])[None, :]]  # (blocks, o, o + q + 1)
        rest: Array = np.tensordot(self._near, with_all, axes=1)
        g = rest[:, :, -1] - np.matmul(rest[:, :, o:o + q], theta[unit][..., None])[..., 0]
        alone = np.bincount(unit)[unit] < 2
        result: Array = np.where(alone[:, None], 0.0, np.linalg.solve(rest[:, :, :o] + np.diag(1 / v), g[..., None])[..., 0])
        return result

    def _own_gains(self, take: Index, own: Index, theta: Array, v: Array) -> Array:
        """Energy (units, joints) that a recording's own columns take away, each block predicted by the others."""
        a, G, unit = self._predicted(take, own, theta, v), self.blocks.G, self.blocks.unit
        residual = G[:, :, own, -1] - np.einsum("bjoq,bq->bjo", G[:, :, own[:, None], take[None, :]], theta[unit], optimize=True)
        H = G[:, :, own[:, None], own[None, :]]
        gain = 2 * np.einsum("bo,bjo->bj", a, residual) - np.einsum("bo,bjor,br->bj", a, H, a, optimize=True)
        result = np.zeros((int(unit.max()) + 1, gain.shape[1]))
        np.add.at(result, unit, gain)
        return result
