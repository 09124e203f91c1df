"""Values of the chosen effects with their covariance, and how alike the torques of two rivals are: algebra on Gram matrices.

    theta = A^-1 g,   cov = A^-1 (sum_b s_b s_b') A^-1,   s_b the score of block b         (sandwich over blocks)

A nonlinear parameter enters by its tangent, the difference of the fitted torques at its neighbouring values in the bank. It is known no
better than the values that were tried tell (nnhydro.diagnosis.shape_spread).
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.race import Race, columns_of, own_of
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.shape_spread import same_but, spreads, student

Array = NDArray[np.float64]
NOTHING_KNOWN = 1e100  # times a variance: no interval is wider, and none overflows
SETTLING, SMALLEST = 20, 1e-6  # steps of a weighted mean square, and a size that is none


@final
@dataclass(frozen=True, eq=False)
class Fit:
    """Values and covariance of all parameters; `places` says where a candidate's linear and nonlinear ones stand."""

    theta: Array
    covariance: Array
    places: dict[int, list[int]]
    own: dict[int, tuple[Array, Array]]  # amplitudes of candidates whose values are each recording's own

    def of(self, candidate: Candidate) -> tuple[Array, Array]:
        """Return values and covariance of the candidate: linear, then nonlinear in the order of its spans."""
        if id(candidate) in self.own:
            return self.own[id(candidate)]
        place = self.places[id(candidate)]
        return self.theta[place], self.covariance[np.ix_(place, place)]


def _tangents(race: Race, candidate: Candidate, values: dict[int, float]) -> list[tuple[Array, float]]:
    """(bank direction (P,), present value) of each nonlinear parameter: d(fitted torque)/d parameter as a combination of columns."""
    made = []
    for name in candidate.instance.spans:
        value = float(getattr(candidate.instance.effect, name)[0])
        beside = [(float(getattr(c.instance.effect, name)[0]), c) for c in race.bank.candidates
                  if c.key == candidate.key and same_but(name, c, candidate)]
        low = max((b for b in beside if b[0] < value), key=lambda b: b[0], default=(value, candidate))
        high = min((b for b in beside if b[0] > value), key=lambda b: b[0], default=(value, candidate))
        direction = np.zeros(race.bench.total.shape[0])
        width = high[0] - low[0]
        if width > 0:
            for sign, (_, c) in ((1.0, high), (-1.0, low)):
                for k, mine in zip(c.columns, candidate.columns, strict=True):
                    direction[race.bench.p + k] += sign * values[mine] / width
        made.append((direction, value))
    return made


def _unit_sums(scores: Array, bench: Bench) -> Array:
    made = np.zeros((len(bench.by_unit[1]), scores.shape[1]))
    np.add.at(made, bench.blocks.unit, scores)
    return made


def _widened(covariance: Array, H: Array, scores: Array, A: Array) -> Array:
    """`covariance` widened where leaving out whole recordings says more, and by Student's factor for their number.

        theta_(-u) - theta = -(A - H_u)^-1 s_u,   var = (n - 1) / n sum_u (theta_(-u) - theta)^2      (jackknife over recordings)
    """
    n = len(scores)
    if n < 2:
        return covariance
    steps = np.linalg.solve(A[None] - H, scores[..., None])[..., 0]
    jackknife = (n - 1) / n * (steps**2).sum(axis=0)
    known = np.maximum(np.diag(covariance), np.maximum(jackknife / NOTHING_KNOWN, 1e-300))
    wider = np.sqrt(np.maximum(1.0, jackknife / known)) * student(n)
    return np.asarray(covariance * wider[:, None] * wider[None, :], np.float64)


def fitted(race: Race) -> Fit:
    """Return the fit of baseline and chosen effects to all recordings."""
    bench = race.bench
    columns, own = columns_of(race.chosen), own_of(race.chosen)
    take = np.concatenate([bench.index(columns), bench.p + own])
    baseline, values = race.values(race.chosen)
    solved = np.concatenate([baseline, [values[k] for k in columns.tolist()]])
    basis, theta, places = [np.eye(bench.total.shape[0])[:, k] for k in take], [*solved, *np.zeros(len(own))], {}
    for c in race.chosen:
        places[id(c)] = [bench.p + int(np.searchsorted(columns, k)) for k in c.columns]
        for direction, value in _tangents(race, c, values) if not c.own else []:
            places[id(c)].append(len(basis))
            basis.append(direction)
            theta.append(value)
    T, size = np.stack(basis, axis=1), len(take)
    offset = np.concatenate([theta[:size], np.zeros(len(theta) - size)])
    H = T.T @ bench.total @ T
    penalty = np.concatenate([bench.prior, 1e-8 * np.diag(H)[bench.p:] + 1e-12])
    bread = np.linalg.inv(H + np.diag(penalty))
    G = bench.joint_sums
    scores = (G[:, :, -1] - np.einsum("bpq,q->bp", G, T @ offset)) @ T
    scores = scores - scores.mean(axis=0)
    blocks = len(G)
    meat = scores.T @ scores * blocks / max(blocks - len(theta), 1) + np.diag(np.where(np.arange(len(theta)) < bench.p, penalty, 0.0))
    covariance = _widened(bread @ meat @ bread, T.T @ bench.unit_sums @ T, _unit_sums(scores, bench), np.linalg.inv(bread))
    for c in race.chosen:
        for place, spread in zip(places[id(c)][len(c.columns):], spreads(race, c).values() if not c.own else (), strict=True):
            covariance[place, place] += spread**2
    amplitudes = {id(c): _amplitude(race, c) for c in race.chosen if c.own and not c.columns}
    return Fit(np.array(theta), covariance, places, amplitudes)


def _amplitude(race: Race, candidate: Candidate) -> tuple[Array, Array]:
    """Root mean square over recordings of the values that are each recording's own, as the first of them, less what noise adds."""
    own, columns = np.array(candidate.own), columns_of(race.kept())
    bench = race.bench
    take, beside = bench.index(columns), bench.p + own
    theta = bench.left_out(take, bench.p + own_of(race.chosen))[0]
    G = bench.unit_sums
    H = G[:, beside[:, None], beside[None, :]]
    g = G[:, beside, -1] - np.einsum("uoq,q->uo", G[:, beside[:, None], take[None, :]], theta)
    seen = np.trace(H, axis1=1, axis2=2) > 1e-6 * max(float(np.trace(H, axis1=1, axis2=2).max()), 1e-300)
    inverse = np.linalg.inv(H[seen] + 1e-12 * np.eye(len(own)))
    amplitude, error = _root_mean_square((inverse @ g[seen][..., None])[..., 0], np.einsum("uoo->uo", inverse))
    n = len(own) + len(candidate.instance.spans)
    values = np.array([amplitude, *np.zeros(len(own) - 1), *(getattr(candidate.instance.effect, f)[0] for f in candidate.instance.spans)])
    covariance = np.zeros((n, n))
    covariance[0, 0] = error**2
    for i, spread in enumerate(spreads(race, candidate).values()):
        covariance[len(own) + i, len(own) + i] = spread**2
    return values, covariance


def _root_mean_square(a: Array, noise: Array) -> tuple[float, float]:
    """The size sqrt(o m) of values `a` (units, o) with the variances `noise` (units, o), and its standard deviation over the units.

        m = sum w (a^2 - noise) / sum w,   w = (m + noise)^-2        over units and values: what is hardly seen hardly counts

    Source: weights by the inverse variance of a^2 about normal values, 2 (m + noise)^2.
    """
    excess, n, m = a**2 - noise, len(a), 0.0
    for _ in range(SETTLING):
        w = 1 / (m + noise) ** 2
        m = max(float((w * excess).sum() / w.sum()), 0.0)
    size = max(float(np.sqrt(m * a.shape[1])), SMALLEST)
    off = (w * (excess - (w * excess).sum() / w.sum())).sum(axis=1) * a.shape[1] / w.sum()
    spread = float(np.sqrt((off**2).sum() * n / (n - 1))) if n > 1 else size**2
    return size, min(spread / (2 * size), float(np.sqrt(spread)))


def own_values(race: Race, candidate: Candidate, unit: int) -> Array:
    """Return the values (o,) that the chosen candidate's own columns have in one unit, beside the common fit."""
    own, columns = race.bench.p + np.array(candidate.own), columns_of(race.kept())
    take, G = race.bench.index(columns), race.bench.by_unit[0][unit].sum(axis=0)
    theta = race.bench.left_out(take, race.bench.p + own_of(race.chosen))[0]
    return np.asarray(np.linalg.lstsq(G[np.ix_(own, own)], G[own, -1] - G[np.ix_(own, take)] @ theta, rcond=1e-9)[0], np.float64)


def likeness(race: Race, one: Candidate, other: Candidate) -> float:
    """Return the cosine between the fitted torques of two rivals, each beside the rest of the choice and off what that rest explains."""
    rest = [c for c in race.chosen if c is not one]
    if one.own or other.own:
        return 0.0
    bench = race.bench
    take, total = bench.index(columns_of(rest)), bench.total
    A = total[np.ix_(take, take)] + np.diag(bench.penalty(take))
    fits = []
    for candidate in (one, other):
        by_column = race.values([*rest, candidate])[1]
        direction = np.zeros(len(total))
        direction[bench.p + np.array(candidate.columns)] = [by_column[k] for k in candidate.columns]
        fits.append(direction)
    cross = [total[take] @ d for d in fits]

    def product(i: int, j: int) -> float:
        return float(fits[i] @ total @ fits[j] - cross[i] @ np.linalg.solve(A, cross[j]))

    return float(product(0, 1) / np.sqrt(max(product(0, 0) * product(1, 1), 1e-300)))
