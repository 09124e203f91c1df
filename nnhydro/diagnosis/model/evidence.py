"""The evidence of a set of effects beside baseline and unknown, in closed form on whitened Gram matrices.

    y ~ N(0, V + A L A'),   A = [Y, Phi_1, ..., Phi_J, X_S],   L = diag(1, tau^2 s^2, RHO^2)
    log p(y | S) = -1/2 [log|V| + log|M| + y'W y - b'M^-1 b],   W = V^-1,  G = A'W A,  M = I + L^1/2 G L^1/2,  b = L^1/2 A'W y

Columns of hypotheses are scaled so that the value 1 makes the torque's rms at the joint where it weighs most: RHO is the prior standard
deviation of an effect in shares of the torque. Source: MacKay (1992), Neural Computation 4; Rasmussen & Williams (2006), section 5.4.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.model.arrowhead import Arrowhead
from nnhydro.diagnosis.model.unknown import Unknown
from nnhydro.diagnosis.problem.design import Design

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@final
@dataclass(eq=False)
class WhiteRows:
    """Rows of a design divided by the noise `v` (n, joints): Gram matrix of baseline and unknown, and products with further columns."""

    design: Design
    unknown: Unknown
    v: Array
    rows: Index | None = None  # rows that count; all by default
    G: Array = field(init=False)
    b: Array = field(init=False)
    yy: float = field(init=False)
    log_v: float = field(init=False)

    def __post_init__(self) -> None:
        rows = slice(None) if self.rows is None else self.rows
        self.sw = 1.0 / np.sqrt(self.v[rows])
        self.Y = self.design.Y[rows] * self.sw[..., None]
        self.y = self.design.y[rows] * self.sw
        self.Phi = self.unknown.Phi[rows]
        self.group = self.design.problem.group_of[rows]
        p, m, joints = self.Y.shape[2], self.Phi.shape[1], self.y.shape[1]
        self.p, self.m, self.joints = p, m, joints
        P = p + joints * m
        self.G, self.b = np.zeros((P, P)), np.zeros(P)
        flat = self.Y.reshape(self.y.size, p)
        self.G[:p, :p], self.b[:p] = flat.T @ flat, flat.T @ self.y.ravel()
        for j in range(joints):
            at = slice(p + j * m, p + (j + 1) * m)
            scaled = self.Phi * self.sw[:, j:j + 1]
            self.G[at, at], self.b[at] = scaled.T @ scaled, scaled.T @ self.y[:, j]
            self.G[at, :p] = scaled.T @ self.Y[:, j]
            self.G[:p, at] = self.G[at, :p].T
        self.yy, self.log_v = float((self.y**2).sum()), float(np.log(self.v[rows]).sum())

    def parts(self, live: Index) -> list[Index]:
        """Return which of the coefficients `live` are of the unknown at each joint, and which of the baseline, the last."""
        ends = np.searchsorted(live, self.p + self.m * np.arange(self.joints + 1)).tolist()
        return [*(live[start:stop] for start, stop in pairwise(ends)), live[: ends[0]]]

    @property
    def unknown_of_unit_share(self) -> Array:
        """Prior standard deviations (joints m,), N m, of an unknown whose groups together make each joint's torque, all as much."""
        u, design = self.unknown, self.design
        energy = np.bincount(u.group, u.s**2 * (u.Phi**2).sum(axis=0), len(u.names)) / design.duration
        sizes = 1.0 / np.sqrt(np.maximum(len(u.names) * energy, 1e-300))
        return np.concatenate([sizes[u.group] * u.s * scale for scale in design.scale])

    def cross(self, Xw: Array, at: Index | slice = slice(None)) -> Array:
        """Return A'W^1/2 Xw (P, K) of whitened columns Xw (n, joints, K) on the counted rows `at`, all by default."""
        count, k = Xw.shape[0] * self.joints, Xw.shape[2]
        made = np.zeros((len(self.b), k))
        made[: self.p] = self.Y[at].reshape(count, self.p).T @ Xw.reshape(count, k)
        for j in range(self.joints):
            made[self.p + j * self.m: self.p + (j + 1) * self.m] = (self.Phi[at] * self.sw[at, j:j + 1]).T @ Xw[:, j]
        return made

    def weigh(self, X: Array) -> Array:
        """Return X (n, joints, K) on the counted rows divided by the noise."""
        return (X if self.rows is None else X[self.rows]) * self.sw[..., None]


@final
@dataclass(frozen=True, eq=False)
class Columns:
    """Columns of a set of hypotheses beside baseline and unknown: `Xw` (n, joints, k) whitened, their products, and which belongs to which.

    `scale` (k,) is the torque's rms over the column's.
    """

    Xw: Array
    cross: Array  # (P, k)
    gram: Array  # (k, k)
    Xy: Array  # (k,)

    @staticmethod
    def of(whitened: WhiteRows, Xw: Array) -> "Columns":
        """Return the whitened columns Xw (n, joints, k) on the counted rows with their products."""
        flat = Xw.reshape(-1, Xw.shape[2])
        return Columns(Xw, whitened.cross(Xw), flat.T @ flat, flat.T @ whitened.y.ravel())

    def join(self, other: "Columns") -> "Columns":
        """Return both sets of columns side by side."""
        k = self.Xw.shape[2]
        between = self.Xw.reshape(-1, k).T @ other.Xw.reshape(-1, other.Xw.shape[2])
        gram = np.block([[self.gram, between], [between.T, other.gram]])
        return Columns(np.concatenate([self.Xw, other.Xw], axis=2), np.concatenate([self.cross, other.cross], axis=1), gram,
                       np.concatenate([self.Xy, other.Xy]))


@final
@dataclass(frozen=True, eq=False)
class Posterior:
    """The fit of a set at sizes `t` (P,) of baseline (1) and unknown: evidence, mean and Cholesky factor of M in the scaled columns.

    A coefficient of size 0 is 0 and has no row in M: `live` (l,) are the others of all P + k, in the order of M.
    """

    log_evidence: float
    mean: Array  # (P + k,) of the unscaled coefficients
    factor: Arrowhead  # of M
    scale: Array  # (P + k,) prior standard deviations
    half: Array  # (l,) L^-1 b
    live: Index  # (l,)

    def projection(self, cross: Array) -> Array:
        """Return C (l, m) of columns whose products with the fit's are `cross` (P + k, m): the fit takes C'C of their Gram matrix."""
        return self.factor.forward(cross[self.live] * self.scale[self.live, None])

    def covariance(self, at: slice | Index) -> Array:
        """Return the covariance of the coefficients `at`."""
        half = self.factor.forward(np.eye(len(self.scale))[self.live][:, at])
        covariance: Array = half.T @ half * self.scale[at][:, None] * self.scale[at]
        return covariance

    def variances(self) -> Array:
        """Return the posterior variance of every scaled coefficient, prior variance 1, (P + k,)."""
        made = np.ones(len(self.scale))
        made[self.live] = self.factor.inverse_diagonal()
        return made


def posterior(whitened: WhiteRows, columns: Columns | None, t: Array) -> Posterior:
    """Return the fit of `columns` (None: none) beside baseline and unknown with prior standard deviations `t` (P,)."""
    k = 0 if columns is None else len(columns.Xy)
    scale = np.concatenate([t, np.full(k, RHO)])
    *outer, base = whitened.parts(np.flatnonzero(t))
    live, p = np.concatenate([*outer, base, np.arange(len(t), len(scale))]), len(base)
    G, s = whitened.G, scale[live[len(live) - p - k:]]

    def cross(at: NDArray[np.intp]) -> Array:
        return np.hstack([G[at[:, None], base], np.empty((len(at), 0)) if columns is None else columns.cross[at]])

    inner = cross(base) if columns is None else np.vstack([cross(base), np.hstack([columns.cross[base].T, columns.gram])])
    borders = [cross(at) for at in outer]
    for border, at in zip(borders, outer, strict=True):
        border *= t[at, None]
        border *= s
    factor = Arrowhead.of([_with_prior(G[at[:, None], at], t[at]) for at in outer], borders, _with_prior(inner, s))
    half = factor.forward((whitened.b if columns is None else np.concatenate([whitened.b, columns.Xy]))[live] * scale[live])
    mean = np.zeros(len(scale))
    mean[live] = factor.backward(half) * scale[live]
    log_evidence = -0.5 * (whitened.log_v + factor.log_determinant() + whitened.yy - float(half @ half))
    return Posterior(log_evidence, mean, factor, scale, half, live)


def added_evidence(M: Array, b: Array) -> tuple[Array, Array]:
    """Return M^-1 b, and the log evidence (laws, ...) that columns of a law add: (RHO^2 b'M^-1 b - log|M|) / 2.

    M (laws, k, k) is 1 + RHO^2 times the Gram matrix of the columns beside all else, b (laws, k, ...) their product with what is left.
    """
    draws = b.ndim == 3
    half = np.asarray(np.linalg.solve(M, b if draws else b[..., None]), dtype=float)
    half = half if draws else half[..., 0]
    logdet = np.linalg.slogdet(M)[1]
    return half, 0.5 * (RHO**2 * (b * half).sum(axis=1) - (logdet[:, None] if draws else logdet))


def _with_prior(gram: Array, s: Array) -> Array:
    """I + s G s of a Gram matrix G, which is used up, and prior standard deviations s."""
    gram *= s[:, None]
    gram *= s
    gram.ravel()[::len(s) + 1] += 1.0 + 1e-9
    return gram
