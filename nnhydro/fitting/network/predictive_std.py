"""How far a trained ensemble can be trusted: distance from its rows, and a deviation calibrated on recordings that it was not trained on.

    h = x' (C + lambda I)^-1 x / limit          C = mean x x' over the training rows, x the odd features, standardised
    std^2 = (k s)^2 + (c S)^2 + a^2 + (u (1 - phi) S)^2,   phi = 1 / (1 + h)

`limit` is LIMIT times the mean distance of the training rows; held-out recordings of the same campaign reach three to ten times that mean.
Each member watches recordings that it does not train on. k, c and a are the non-negative least squares of r^2 on s^2, S^2 and 1, r what
the members that watch a row leave of it; then one factor a joint makes 95 % of the rows of a new recording lie within their intervals
(`conformal_quantile`), every watched recording counting alike. u is the rms of target / S: far from the data the error is that of the
baseline. Source: split-conformal calibration, Vovk et al. (2005), Lei et al. (2018); groups: Dunn, Wasserman & Ramdas (2023); the terms
are ours.
"""

from dataclasses import replace
from itertools import product
from statistics import NormalDist

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.fitting.network.rows import CHUNK, Rows
from nnhydro.fitting.network.stacking import CAUTIONS, NETWORKS, SHARES, credit, held_out, stack
from nnhydro.models.learned.learned import CAUTION, LearnedTorque, spread_of

Array = NDArray[np.float64]
RIDGE = 1e-4  # lambda, of the largest eigenvalue of C: directions that the recordings hardly move in are not counted
LIMIT = 200.0  # beyond it held-out residuals of the learner grew past those of the baseline
LEVEL = 0.95
MOST = 200_000  # watched rows looked at: quantiles are then known to 0.1 %
ROUNDS = 5


def _root(C: Tensor) -> Tensor:
    """R (k, r) with R R' = (C + lambda I)^-1."""
    values, vectors = torch.linalg.eigh(C)
    root: Tensor = vectors / torch.sqrt(values.clamp(min=0.0) + RIDGE * values[-1].clamp(min=1e-12))
    return root


def support(rows: Rows) -> Tensor:
    """Return R (features, r) with h = |R' x|^2, zero for even features."""
    odd = (rows.parity < 0).double()
    C = torch.zeros(rows.x.shape[1], rows.x.shape[1], dtype=torch.float64)
    for start in range(0, len(rows.x), CHUNK):
        x = rows.x[start:start + CHUNK].double() * odd
        C += x.T @ x
    C /= len(rows.x)
    root = _root(C)
    usual = (root * (C @ root)).sum()  # mean of x' (C + lambda I)^-1 x: the number of directions that the recordings move in
    return odd[:, None] * root / torch.sqrt(LIMIT * usual.clamp(min=1e-12))


def sample_rows(unit: Tensor, watched: Tensor) -> Tensor:
    """Return the indices of at most MOST rows, of the units `unit` (n,), that a member watches (E, units), evenly spaced."""
    index = watched.any(dim=0)[unit].nonzero().ravel()
    return index[:: len(index) // MOST + 1]


def out_of_fold(model: LearnedTorque, rows: Rows, watched: Tensor) -> tuple[Tensor, ...]:
    """Return residual r, scatter s, scale S (m, joints) N m, phi (m, 1), unit (m,) and target (m, joints) of rows that a member watches."""
    index = sample_rows(rows.unit, watched)
    parts, left_out = [], float(watched.double().mean())
    for piece in torch.split(index, CHUNK):
        x, scale = rows.x[piece].double(), rows.scale[piece].double()
        phi = model.familiarity(x)
        assert rows.linear is not None
        members = model.correction(x, scale, rows.linear[piece].double().transpose(0, 1))
        mine = watched[:, rows.unit[piece]]
        shrunk_by = (None if model.baseline is None else left_out, model.fit.get(CAUTION, 1.0))
        predicted, target = held_out(members, mine, scale, *shrunk_by), rows.target_of(piece, mine)
        whole = members if rows.parting is None else members + rows.parting[piece].double().transpose(0, 1)
        scatter = whole.std(dim=0) if len(members) > 1 else torch.zeros_like(predicted)
        if rows.replaced is not None:
            replaced, known = torch.split(rows.replaced[piece].double(), [scale.shape[1], 1], dim=1)
            predicted, scatter = model.blend(predicted, scatter, model.fading(x) * replaced, known)
        parts.append((target - predicted, scatter, scale, phi, rows.unit[piece], target))
    return tuple(torch.cat(column) for column in zip(*parts, strict=True))


def _variance_terms(r: Array, s: Array, S: Array) -> Array:
    """Non-negative (k^2, c^2, a^2) of r^2 = k^2 s^2 + c^2 S^2 + a^2, weighted by the inverse square of what they give."""
    from scipy.optimize import nnls

    A = np.column_stack([s**2, S**2, np.ones_like(s)])
    size = np.maximum(A.mean(axis=0), 1e-300)
    found = np.array([0.0, 0.0, float((r**2).mean()) + 1e-300])
    for _ in range(ROUNDS):
        weight = 1 / (A @ found + 1e-3 * (r**2).mean() + 1e-300)
        found = nnls(A / size * weight[:, None], r**2 * weight)[0] / size
    return found


def conformal_quantile(ratio: Array, unit: Array, level: float) -> float:
    """Return q with P(ratio of a row of a new recording <= q) >= `level`, recordings exchangeable and rows drawn at random in each.

    The mixture of the recordings' empirical distributions, each with mass 1/(n + 1), the new one at infinity. Fewer recordings than level
    over 1 - level cannot promise that much (20 are needed for 95 %): then the mixture of those there are, which promises level n/(n + 1).
    Source: Dunn, Wasserman & Ramdas (2023), J. Am. Stat. Assoc. 118, 2491, section 3.1 (pooled distributions of groups).
    """
    _, place, count = np.unique(unit, return_inverse=True, return_counts=True)
    n = len(count)
    wanted = level * (n + 1) / n if level * (n + 1) / n < 1 else level
    order = np.argsort(ratio)
    cumulated = np.cumsum((1 / count[place])[order]) / n
    at = min(int(np.searchsorted(cumulated, wanted * (1 - 1e-12))), len(order) - 1)
    return float(ratio[order[at]])


def _factor(ratio: Array, unit: Array) -> float:
    """Factor on the standard deviation with which LEVEL of |r| / std lies within its Gaussian bounds."""
    return max(conformal_quantile(ratio, unit, LEVEL), 1e-6) / NormalDist().inv_cdf(0.5 + LEVEL / 2)


def _with_networks(model: LearnedTorque, b: float) -> LearnedTorque:
    factor = torch.full((model.ensemble.members, 1, model.ensemble.outputs), b, dtype=torch.float64)
    return replace(model, ensemble=model.ensemble.times(factor))


def _with_caution(model: LearnedTorque, q: float) -> LearnedTorque:
    """The model with q times its members' disagreement, and its distance from the training."""
    return replace(model, fit={**model.fit, CAUTION: q}, support=None if model.support is None else q**0.5 * model.support)


def with_trust(model: LearnedTorque, rows: Rows, watched: Tensor) -> LearnedTorque:
    """Return `model` stacked on the recordings that its members watch (stacking.py): how much of its networks and, of a hybrid, of all
    that is learned, and how cautiously. A model none of whose recordings was watched stays as it is.
    """
    if not bool(watched.any()):
        return model
    hybrid, candidates = model.baseline is not None, {}
    for q, b in product(CAUTIONS if hybrid else CAUTIONS[:1], NETWORKS):
        r, _, _, _, unit, target = out_of_fold(_with_networks(_with_caution(model, q), b), rows, watched)
        candidates[q, b] = target - r
    (q, b), trust = stack(target, candidates, unit, SHARES if hybrid else (1.0,))
    fitted = float((~watched).double().mean())
    chosen = _with_networks(_with_caution(model, q) if hybrid else model, b)
    return replace(chosen, trust=credit(trust, fitted) if hybrid else None)


def with_std(model: LearnedTorque, rows: Rows, watched: Tensor) -> LearnedTorque:
    """Return `model` with its calibrated `doubt`; unchanged where no recording was watched."""
    if not bool(watched.any()):
        return model
    r, s, S, phi, unit, _ = out_of_fold(model, rows, watched)
    u = (rows.target.double() / rows.scale.double()).pow(2).mean(dim=0).sqrt()
    columns = []
    for j in range(r.shape[1]):
        k2, c2, a2 = _variance_terms(*(x[:, j].numpy() for x in (r, s, S)))
        start = torch.tensor([[k2**0.5], [c2**0.5], [a2**0.5], [float(u[j])]], dtype=torch.float64)
        std = spread_of(start, s[:, j:j + 1], S[:, j:j + 1], phi)[:, 0].clamp(min=1e-12)
        factor = _factor((r[:, j].abs() / std).numpy(), unit.numpy())
        columns.append(start[:, 0] * torch.tensor([factor, factor, factor, 1.0], dtype=torch.float64))
    return replace(model, doubt=torch.stack(columns, dim=1))
