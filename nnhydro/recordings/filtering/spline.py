"""Regression splines through several records of one motion, each of another derivative.

    minimise  sum_k w_k sum (x_k - B^(k) c)^2        B^(k): quintic B-splines on even knots, differentiated k times

A record whose constant explains as much as a spline does, but for noise, is at rest:

    sum w |x - constant|^2 - sum w |x - B c|^2 <= m + AT_REST sqrt(2 m)        chi-squared of the m coefficients of c

A smoothing spline through one record on even times leaves out what lies above a cut-off:

    minimise  sum (x - s)^2 dt + (2 pi f_c)^-10 integral (s^(5))^2 dt        gain(f) = 1 / (1 + (f/f_c)^10)

Its ends are as free as the record: no row is invented beyond them, as the padding of a filter does.

Source: de Boor (1978), chapter 14; the gain of a smoothing spline, Silverman (1984), Ann. Stat. 12, 898.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Channel = tuple[int, Array, Array]  # derivative, values (n, c), weights (c,)
KNOTS_PER_PERIOD = 4.0  # of the band's edge: the spline passes all below it
SHARPER = 4.0  # times as many knots where accelerations are measured: they hold the corners of a motion
AT_REST = 4.0  # standard deviations above the mean of chi-squared up to which all that a spline explains is noise
DEGREE = 5
STIFFEST = 1e5  # times the weight of the record: pieces far shorter than a period are quartics anyway


def _basis(t: Array, knots: Array, order: int) -> Any:
    """The B-splines (n, m) on `knots`, differentiated `order` times, as a sparse matrix."""
    from scipy.interpolate import BSpline
    from scipy.sparse import diags

    k, inner = DEGREE, knots
    change: Any = None
    for _ in range(order):
        width = inner[k + 1:len(inner) - 1] - inner[1:len(inner) - k - 1]
        m = len(inner) - k - 1
        bands: Any = [-k / width, k / width]
        D: Any = diags(bands, [0, 1], shape=(m - 1, m))
        change = D if change is None else D @ change
        inner, k = inner[1:-1], k - 1
    B = BSpline.design_matrix(t, inner, k)
    return B if change is None else B @ change


def _bands(B: Any) -> Array:
    """The upper diagonals (DEGREE + 1, m) of B'B, the main one last, as LAPACK holds them."""
    H = B.T @ B
    made = np.zeros((DEGREE + 1, H.shape[0]))
    for offset in range(DEGREE + 1):
        made[DEGREE - offset, offset:] = H.diagonal(offset)
    return made


@final
@dataclass(frozen=True, eq=False)
class RegressionSplines:
    """Splines on the same times: their knots, and by derivative B^(k) with the diagonals of B^(k)'B^(k), made once for all records."""

    knots: Array  # (m + DEGREE + 1,) s
    bases: dict[int, Any]  # sparse (n, m)
    bands: dict[int, Array]  # (DEGREE + 1, m)

    @staticmethod
    def of(t: Array, edge: float, orders: Collection[int]) -> "RegressionSplines":
        """Return splines on the times `t` (n,) s that pass what lies below `edge` Hz, through records of the derivatives `orders`."""
        wanted = np.ceil(float(t[-1] - t[0]) * KNOTS_PER_PERIOD * edge * (SHARPER if 2 in orders else 1.0))
        pieces = int(min(max(wanted, 4), max(len(t) // 2, 4)))
        knots = np.concatenate([np.full(DEGREE, t[0]), np.linspace(t[0], t[-1], pieces + 1), np.full(DEGREE, t[-1])])
        bases = {order: _basis(t, knots, order) for order in orders}
        return RegressionSplines(knots, bases, {order: _bands(B) for order, B in bases.items()})

    def through(self, channels: Sequence[Channel], may_rest: bool = True) -> Any:
        """Return the spline through `channels`; `may_rest`: a constant where all is noise."""
        from scipy.interpolate import BSpline
        from scipy.linalg import cho_solve_banded, cholesky_banded

        weights = np.array([w for _, _, w in channels])  # (channels, c)
        g = sum(self.bases[order].T @ (values * w) for order, values, w in channels)
        c = np.empty_like(g)
        for same in np.unique(weights, axis=1).T:
            at = np.flatnonzero((weights == same[:, None]).all(axis=0))
            H = sum(w * self.bands[order] for (order, *_), w in zip(channels, same, strict=True))
            H[-1] += 1e-9 * np.median(H[-1])
            c[:, at] = cho_solve_banded((cholesky_banded(H), False), g[:, at])
        if may_rest:
            constant = np.broadcast_to(channels[0][1].mean(axis=0), c.shape)
            resting = self._energy(c, g, channels) - self._energy(constant, g, channels) <= len(c) + AT_REST * np.sqrt(2 * len(c))
            c = np.where(resting, constant, c)
        return BSpline(self.knots, c, DEGREE)

    def _energy(self, c: Array, g: Array, channels: Sequence[Channel]) -> Array:
        """The energy (columns,) that the splines with coefficients `c` (m, columns) take from the records."""
        Hc = sum(self.bases[order].T @ ((self.bases[order] @ c) * w) for order, _, w in channels)
        made: Array = (c * (2 * g - Hc)).sum(axis=0)
        return made


@final
@dataclass(frozen=True)
class SmoothingSpline:
    """The smoothing spline of a motion without a torque: it passes what lies below `cutoff_hz` Hz."""

    cutoff_hz: float

    def apply(self, x: Array, dt: float) -> Array:
        """Return `x` (n, ...) evenly sampled every `dt` s, smoothed along its first axis; a linear operator on `x`."""
        from scipy.linalg import cho_solve_banded, cholesky_banded

        t, flat = np.arange(len(x), dtype=np.float64) * dt, x.reshape(len(x), -1)
        splines = RegressionSplines.of(t, 2 * self.cutoff_hz, (0,))  # knots so close that the stiffness alone smooths
        edges = np.unique(splines.knots)
        width = float(edges[1] - edges[0])  # s; the fifth derivative is constant from knot to knot
        bent = _basis((edges[1:] + edges[:-1]) / 2, splines.knots, DEGREE) * width**DEGREE
        stiffness = min((2 * np.pi * self.cutoff_hz * width) ** (-2 * DEGREE), STIFFEST) * width / dt
        B = splines.bases[0]
        c = cho_solve_banded((cholesky_banded(splines.bands[0] + stiffness * _bands(bent)), False), B.T @ flat)
        result: Array = np.ascontiguousarray(B @ c).reshape(x.shape)
        return result
