"""Separable least squares: linear in theta for each value of one or two shape parameters nu, so that only nu is searched.

    minimise  E(nu) = min_theta |y - X(nu) theta|^2 + |z - Z theta|^2

For each nu the linear problem is solved exactly by QR of [X | y], block by block (a recording, a slew) and then over the blocks. The
corner of R is the root of E itself, without the cancellation of normal equations, so that E may be searched down to rounding.
E is tabulated over the whole range of nu before the best of its minima are polished: no start value, no local minimum missed that the
table shows. Source: variable projection, Golub & Pereyra (2003), as told at
https://stat.ethz.ch/pipermail/r-help/2008-July/167107.html; McLain & Rock (1998), eq. (33) is of this form.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Energy = Callable[[tuple[float, ...]], float]
Reduced = Callable[[tuple[float, ...]], Array]  # nu -> blocks (blocks, p + 1, p + 1): R of [X | y] of each
POLISHED = 3  # minima of the table that are looked at; those that cannot be the best are only estimated
CONVERGED = 1e-7  # relative change of nu at which the polishing stops
WELL = 1e-3  # share of a column that the others must leave for normal equations to serve


def reduce(X: Array, y: Array) -> Array:
    """Return R (p + 1, p + 1), upper triangular, of [X | y]; X (n, p), y (n,).

    Cholesky's factor of X'X with a residual that is computed, not subtracted, serves well-conditioned columns (an error of theta enters
    the residual squared) several times as fast as Householder's on tall blocks; else Householder's is taken.
    """
    scale = np.sqrt(np.einsum("np,np->p", X, X))
    if len(X) < X.shape[1] + 1 or not scale.all():
        return _householder(np.column_stack([X, y]))
    gram, projected = (X.T @ X) / np.outer(scale, scale), (X.T @ y) / scale
    try:
        R = np.linalg.cholesky(gram).T
    except np.linalg.LinAlgError:
        return _householder(np.column_stack([X, y]))
    if np.abs(np.diag(R)).min() < WELL:
        return _householder(np.column_stack([X, y]))
    c = np.linalg.solve(R.T, projected)
    correction = (X.T @ (y - X @ (np.linalg.solve(R, c) / scale))) / scale  # one step of refinement
    c = c + np.linalg.solve(R.T, correction)
    rest = np.linalg.norm(y - X @ (np.linalg.solve(R, c) / scale))
    return np.block([[R * scale, c[:, None]], [np.zeros((1, len(c))), np.array([[rest]])]])


def _householder(rows: Array) -> Array:
    size = rows.shape[1]
    if len(rows) < size:
        rows = np.concatenate([rows, np.zeros((size - len(rows), size))])
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=float)


@final
@dataclass(frozen=True, eq=False)
class LinearFit:
    """Solution of the linear problem at one nu."""

    theta: Array  # (p,)
    energy: float  # E, prior included
    condition: float  # of X with its columns scaled to 1


def solve(blocks: Array, prior: Array | None = None) -> LinearFit:
    """Return the solution over stacked `blocks` (blocks, p + 1, p + 1) and rows [Z | z] of a `prior` (r, p + 1)."""
    size = blocks.shape[-1]
    rows = blocks.reshape(-1, size)
    R = _householder(rows if prior is None else np.concatenate([rows, prior]))
    scale = np.maximum(np.linalg.norm(R[:-1, :-1], axis=0), 1e-300)
    U, s, Vt = np.linalg.svd(R[:-1, :-1] / scale)
    keep = s > 1e-12 * s[0]
    theta = Vt.T[:, keep] @ ((U.T @ R[:-1, -1])[keep] / s[keep]) / scale
    residual = R[:, -1] - R[:, :-1] @ theta
    return LinearFit(theta, float(residual @ residual), float(s[0] / max(s[-1], 1e-300)))


@final
@dataclass(frozen=True, eq=False)
class SeparableFit:
    """The minimum, and the whole profile E(nu) that shows it is one."""

    nu: tuple[float, ...]
    theta: Array  # (p,)
    energy: float
    condition: float
    grid: tuple[Array, ...]  # values of each nu
    profile: Array  # E on the grid
    minima: tuple[tuple[float, ...], ...]  # best first; the others to a tenth of the grid
    at_bound: bool

    @property
    def note(self) -> str:
        """A sentence for the reader where the result must not be taken at face value, else empty."""
        if self.at_bound:
            return "the travel scale ended on its bound: these motions do not show where the curve becomes constant"
        if self.condition > 1e6:
            return "some ordinates are hardly excited: judge the curve, not its ordinates, and only where the motions went"
        return ""


def _local_minima(profile: Array) -> list[tuple[int, ...]]:
    """Indices of the grid points that no neighbour along an axis undercuts, best first."""
    padded = np.pad(profile, 1, constant_values=np.inf)
    inner = tuple(slice(1, -1) for _ in profile.shape)
    lowest = np.ones(profile.shape, dtype=bool)
    for axis in range(profile.ndim):
        lowest &= (profile <= np.roll(padded, 1, axis)[inner]) & (profile <= np.roll(padded, -1, axis)[inner])
    found = [tuple(int(i) for i in index) for index in np.argwhere(lowest)]
    return sorted(found, key=lambda index: float(profile[index]))


def parabola_vertex(x: Array, y: Array) -> tuple[float, float]:
    """Return where the parabola through the points (x, y), the middle one (0, 0), is lowest, and how far below 0; 0, 0 without one."""
    a, b, _ = np.polyfit(x, y, 2)
    return (float(-b / (2 * a)), float(b**2 / (4 * a))) if a > 0 else (0.0, 0.0)


def _vertex(profile: Array, grid: Sequence[Array], index: tuple[int, ...]) -> tuple[tuple[float, ...], float]:
    """The lowest point of the parabolas through a grid point and its neighbours along each axis: an estimate of nu and E there."""
    nu, lowest = [float(g[i]) for g, i in zip(grid, index, strict=True)], float(profile[index])
    for axis, (g, i) in enumerate(zip(grid, index, strict=True)):
        if 0 < i < len(g) - 1:
            x = np.asarray(g[i - 1:i + 2] - g[i])
            y = np.take(profile, [i - 1, i, i + 1], axis)[tuple(slice(None) if k == axis else j for k, j in enumerate(index))]
            step, drop = parabola_vertex(x, y - y[1])
            nu[axis] += step
            lowest -= drop
    return tuple(nu), lowest


def _polish(energy: Energy, grid: Sequence[Array], index: tuple[int, ...], tolerance: float) -> tuple[float, ...]:
    """nu of the minimum between the neighbours of a grid point."""
    from scipy.optimize import minimize, minimize_scalar

    box = [(float(g[max(i - 1, 0)]), float(g[min(i + 1, len(g) - 1)])) for g, i in zip(grid, index, strict=True)]
    start = [float(g[i]) for g, i in zip(grid, index, strict=True)]
    if len(box) == 1:
        found = minimize_scalar(lambda nu: energy((float(nu),)), bounds=box[0], method="bounded", options={"xatol": tolerance})
        best: tuple[float, ...] = (float(found.x),)
    else:
        options: Any = {"xatol": max(tolerance, 1e-4), "fatol": 0.0, "maxfev": 80}

        def at(nu: Array) -> float:
            return energy(tuple(nu.tolist()))

        many = minimize(at, np.array(start), method="Nelder-Mead", bounds=box, options=options)
        best = tuple(float(x) for x in many.x)
    return min(best, tuple(start), key=energy)


def separable(at: Reduced, grid: Sequence[Array], prior: Array | None = None, polished: int = POLISHED) -> SeparableFit:
    """Return the best nu and theta; `grid` tabulates each component of nu, ends included, at least three values each."""
    seen: dict[tuple[float, ...], LinearFit] = {}

    def linear(nu: tuple[float, ...]) -> LinearFit:
        """Return the linear fit at the nonlinear values `nu`, computed once."""
        if nu not in seen:
            seen[nu] = solve(at(nu), prior)
        return seen[nu]

    def energy(nu: tuple[float, ...]) -> float:
        return linear(nu).energy

    shape = tuple(len(g) for g in grid)
    profile = np.array([energy(tuple(float(x) for x in nu)) for nu in product(*grid)]).reshape(shape)
    found: list[tuple[float, tuple[float, ...]]] = []
    for index in _local_minima(profile)[:polished]:
        nu, lowest = _vertex(profile, grid, index)
        if len(nu) > 1 or not found or lowest < found[0][0]:
            nu = _polish(energy, grid, index, CONVERGED)
            lowest = energy(nu)
        found = sorted([*found, (lowest, nu)])
    minima = [nu for _, nu in found]
    best = linear(minima[0])
    edge = any(abs(x - g[0]) < 1e-3 * (g[-1] - g[0]) or abs(x - g[-1]) < 1e-3 * (g[-1] - g[0])
               for x, g in zip(minima[0], grid, strict=True))
    return SeparableFit(minima[0], best.theta, best.energy, best.condition, tuple(grid), profile, tuple(minima), edge)


def bootstrap(at: Reduced, grid: Array, draws: int, seed: int, prior: Array | None = None) -> tuple[Array, Array]:
    """Return nu (draws,) and theta (draws, p) refitted to blocks drawn with replacement; one nu, searched on `grid` (k,)."""
    stacks = np.stack([at((float(nu),)) for nu in grid])  # (k, blocks, p + 1, p + 1)
    gram = stacks.swapaxes(-1, -2) @ stacks
    count, size = gram.shape[1], gram.shape[-1]
    known = np.zeros((size, size)) if prior is None else prior.T @ prior
    rng = np.random.default_rng(seed)
    ridge = 1e-12 * np.eye(size - 1)
    nus, thetas = np.empty(draws), np.empty((draws, size - 1))
    for draw in range(draws):
        times = np.bincount(rng.integers(0, count, count), minlength=count).astype(float)
        G = np.einsum("b,kbpq->kpq", times, gram) + known
        H, g = G[:, :-1, :-1], G[:, :-1, -1]
        theta = np.linalg.solve(H + ridge * np.trace(H, axis1=1, axis2=2)[:, None, None], g[..., None])[..., 0]
        best = int(np.argmin(G[:, -1, -1] - (theta * g).sum(1)))
        nus[draw], thetas[draw] = grid[best], theta[best]
    return nus, thetas
