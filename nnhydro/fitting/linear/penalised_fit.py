"""Least squares with a penalty whose weight the data choose: by generalised cross-validation or on recordings held out.

    theta(lambda) = argmin |y - X theta|^2 + lambda c |P theta - q|^2,    c = |X|^2 / |P|^2 makes lambda a pure number

    GCV(lambda)      = n |y - X theta|^2 / (n - trace(X (X'X + lambda c P'P)^-1 X'))^2      neighbouring rows independent
    held out(lambda) = sum over blocks of |y_b - X_b theta without b|^2                     blocks (recordings) independent

Rows of a recording are not independent: GCV then takes too small a weight. Where there are a few recordings, leave them out.
Source: GCV as in R's mlrv, https://search.r-project.org/CRAN/refmans/mlrv/html/gcv_cov.html; the scaling is ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import require
from nnhydro.fitting.linear.variable_projection import Reduced, solve
from nnhydro.physics.coefficients.travel_bspline import bends
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.travel_added_mass import BsplineAddedMass, StateAddedMass
from nnhydro.physics.loads.travel_drag import BsplineDrag, StateDrag

Array = NDArray[np.float64]
WEIGHTS: Final = np.geomspace(1e-8, 1e2, 41)
DRAGS, INERTIAS = (StateDrag, BsplineDrag), (StateAddedMass, BsplineAddedMass)
CRITERIA: Final = ("gcv", "held out")


@final
@dataclass(frozen=True, eq=False)
class PenalisedFit:
    """The solution, the chosen weight and the score of each weight that was tried."""

    theta: Array  # (p,)
    weight: float
    weights: Array  # (k,)
    scores: Array  # (k,)

    @property
    def at_bound(self) -> bool:
        """True where the smallest or largest weight won: the penalty does not matter, or the curve wants to be straight."""
        return self.weight in (self.weights[0], self.weights[-1])


def bend_rows(loads: Loads) -> Array:
    """Return rows [P | q] (r, p + 1) that measure the bends of the travel curves of `loads`, over all its linear parameters.

    The bends are second differences of the ordinates (the paper's spline) or coefficients (B-splines), the known start included.
    """
    sizes = [len(term.linear_values()) for term in loads.linear().values()]
    rows, start = [], 0
    for term, size in zip(loads.linear().values(), sizes, strict=True):
        if isinstance(term, DRAGS + INERTIAS):
            D, d = bends(size, 0.0 if isinstance(term, DRAGS) else 1.0)
            row = np.zeros((size, sum(sizes) + 1))
            row[:, start:start + size], row[:, -1] = D.numpy(), -d.numpy()
            rows.append(row)
        start += size
    require(bool(rows), "the model has no curve over the travel whose bends could be penalised: state_loads(arm) makes one")
    return np.concatenate(rows)


def _score_gcv(blocks: Array, samples: int, penalty: Array) -> float:
    R: Array = np.asarray(np.linalg.qr(blocks.reshape(-1, blocks.shape[-1]), mode="r"), dtype=float)
    p = R.shape[1] - 1
    G = R[:, :p].T @ R[:, :p]
    theta = solve(blocks, penalty).theta
    misfit = float(np.sum((R[:, p] - R[:, :p] @ theta) ** 2))
    freedom = float(np.trace(np.linalg.pinv(G + penalty[:, :p].T @ penalty[:, :p], hermitian=True) @ G))
    return samples * misfit / (samples - freedom) ** 2


def _score_held_out(blocks: Array, penalty: Array) -> float:
    total = 0.0
    for b in range(len(blocks)):
        theta = solve(np.delete(blocks, b, axis=0), penalty).theta
        total += float(np.sum((blocks[b][:, -1] - blocks[b][:, :-1] @ theta) ** 2))
    return total


def penalised_fit(blocks: Array, samples: int, penalty: Array, criterion: str = "held out", weights: Array = WEIGHTS) -> PenalisedFit:
    """Return the fit to reduced `blocks` (blocks, p + 1, p + 1) of `samples` rows with the weight that scores best.

    `penalty` holds the rows [P | q]; raises ConfigError for an unknown criterion, or where "held out" has a single block.
    """
    require(criterion in CRITERIA, f"criterion {criterion!r}: one of {', '.join(CRITERIA)}")
    require(criterion == "gcv" or len(blocks) > 1, "a single recording cannot be held out: give more, or criterion 'gcv'")
    unit = float(np.linalg.norm(blocks[:, :, :-1])) / max(float(np.linalg.norm(penalty[:, :-1])), 1e-300)

    def score(weight: float) -> float:
        rows = weight**0.5 * unit * penalty
        return _score_gcv(blocks, samples, rows) if criterion == "gcv" else _score_held_out(blocks, rows)

    scores = np.array([score(float(weight)) for weight in weights])
    best = float(weights[int(np.argmin(scores))])
    return PenalisedFit(solve(blocks, best**0.5 * unit * penalty).theta, best, np.asarray(weights, dtype=float), scores)


def penalised_over_scales(at: Reduced, grid: Sequence[Array], penalty: Array, weights: Array) -> tuple[tuple[float, ...], PenalisedFit]:
    """Return the travel scales on the `grid` and the weight that together predict held-out blocks best, and the fit with them."""
    found = [(nu, penalised_fit(at(nu), 1, penalty, "held out", weights)) for nu in (tuple(map(float, x)) for x in product(*grid))]
    return min(found, key=lambda candidate: float(candidate[1].scores.min()))
