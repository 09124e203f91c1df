"""A freer coefficient curve over the travel: B-splines with a penalty on their bends, for more data than twelve slews.

    C(s/D) = C_0 b_0(u) + sum_{k=1..K} c_k b_k(u),    u = min(s / (D end), 1)              [-]
    penalty  lambda sum_k (c_{k-1} - 2 c_k + c_{k+1})^2,   c_0 = C_0, c_{K+1} = c_K

b_k are the clamped uniform B-splines of degree 3 (2 for K = 1) on 0..1; the last two share c_K, so that the curve ends level and stays
constant beyond `end` diameters. The penalty draws it towards a straight line; its weight is chosen by generalised cross-validation or
on held-out recordings (fitting/linear/penalised_fit.py). Source: P-splines of Eilers & Marx (1996), as in R's mgcv,
https://rdrr.io/pkg/mgcv/man/smooth.construct.ps.smooth.spec.html; the end conditions are ours.
"""

from functools import lru_cache

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

FEW = 256  # values


@lru_cache(maxsize=16)
def _knots(count: int) -> tuple[int, NDArray[np.float64]]:
    """Degree and clamped uniform knots of count + 2 B-splines."""
    degree = min(3, count + 1)
    inner = np.linspace(0, 1, count + 3 - degree)
    return degree, np.concatenate([np.zeros(degree), inner, np.ones(degree)])


def pieces(count: int) -> int:
    """Return the number of polynomial pieces of the curve."""
    degree, _ = _knots(count)
    return count + 2 - degree


def _recursion(u: Tensor, count: int) -> Tensor:
    """Values of all count + 2 B-splines at u (...) in 0..1 by the recursion of Cox and de Boor, (..., count + 2)."""
    degree, knots = _knots(count)
    t, x = torch.from_numpy(knots), u[..., None]
    last = t[:-1] == t[t < 1].max()  # the piece that holds its own end
    inside = (x >= t[:-1]) & (t[:-1] < t[1:]) & ((x < t[1:]) | last)
    values = torch.where(inside, 1.0, 0.0).to(torch.float64)
    for p in range(1, degree + 1):
        rise, fall = (t[p:-1] - t[:-p - 1]), (t[p + 1:] - t[1:-p])
        up, down = (torch.where(span > 0, 1 / span.clamp(min=1e-30), 0.0) for span in (rise, fall))
        values = (x - t[:-p - 1]) * up * values[..., :-1] + (t[p + 1:] - x) * down * values[..., 1:]
    return values


def _all(s_over_D: Tensor, end: float, count: int) -> Tensor:
    """Values of all count + 2 B-splines, (..., count + 2)."""
    from scipy.interpolate import BSpline

    degree, knots = _knots(count)
    if 0 < s_over_D.numel() <= FEW:  # in torch, so that a step in time can be differentiated and exported
        return _recursion((s_over_D / end).clamp(max=1.0), count)
    u = (s_over_D / end).clamp(max=1.0).numpy()
    if not u.size:
        return torch.zeros(*u.shape, count + 2, dtype=torch.float64)
    return torch.from_numpy(BSpline(knots, np.eye(count + 2), degree)(u))


def shapes(s_over_D: Tensor, end: float, count: int) -> Tensor:
    """Return b_0, 1 at rest, and b_1 ... b_K at the travel `s_over_D` (...), as (..., 1 + count)."""
    every = _all(s_over_D, end, count)
    return torch.cat([every[..., :count], every[..., count:].sum(-1, keepdim=True)], dim=-1)


def basis(s_over_D: Tensor, end: float, count: int) -> Tensor:
    """Return b_1 ... b_K at the travel `s_over_D` (...), as (..., count)."""
    return shapes(s_over_D, end, count)[..., 1:]


def rest_curve(s_over_D: Tensor, end: float, count: int) -> Tensor:
    """Return b_0 at the travel `s_over_D` (...): 1 at rest."""
    return shapes(s_over_D, end, count)[..., 0]


def bends(count: int, start: float) -> tuple[Tensor, Tensor]:
    """Return D (count, count) and d (count,): the second differences of the coefficients are D c + d, `start` the value at rest."""
    full = torch.zeros(count, count + 2, dtype=torch.float64)
    for k in range(count):
        full[k, k:k + 3] = torch.tensor([1.0, -2.0, 1.0], dtype=torch.float64)
    D = full[:, 1:count + 1].clone()
    D[:, -1] += full[:, count + 1]
    return D, start * full[:, 0]


def curve(s_over_D: Tensor, end: float, start: float, c: Tensor) -> Tensor:
    """Return C(s/D) for the value `start` at rest and the coefficients `c` (K,)."""
    b = shapes(s_over_D, end, len(c))
    return start * b[..., 0] + b[..., 1:] @ c
