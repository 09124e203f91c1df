"""A short formula for what no card explains: a suggestion, not a finding; it changes no finding and no prediction.

    tau = [Y X] theta + F c,   c sparse         by orthogonal matching pursuit, the number of terms by recordings left out

Y are the baseline's columns, X those of the findings, F products of at most two simple functions of the state, each with its unit. All are
fitted together and pass through the filter of the torque. Source: Pati et al. (1993), Asilomar Conf. 27; scikit-learn's implementation.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.blocks import kept_rows
from nnhydro.diagnosis.locks import P_LEFT_OUT, sign_flip_p
from nnhydro.diagnosis.race import Race, columns_of, own_of
from nnhydro.diagnosis.table import Piece, Table
from nnhydro.diagnosis.unknown import FOLDS, REAL, Learned
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.joints import SIGN_WIDTH
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
TERMS = 4  # at most
PLAIN = 0.03  # of the best R2: what a formula with fewer terms may lack
SHARE = 0.5  # of the learner's R2: what a formula must reach to be offered
ALIVE = 1e-4  # of a feature's energy: what the refit of the baseline must leave of it
BASE_UNITS = ("rad", "m", "s")
Exponents = tuple[int, int, int]


@final
@dataclass(frozen=True)
class Feature:
    """A function of the state: what it is called, its unit as exponents of rad, m, s, the signals it needs."""

    name: str
    unit: Exponents
    signals: frozenset[str]
    kind: str

    def times(self, other: "Feature") -> "Feature":
        """Return the product."""
        rad, m, s = (a + b for a, b in zip(self.unit, other.unit, strict=True))
        same = f"{self.name}²" if self.name == other.name else f"{self.name} · {other.name}"
        return Feature(same, (rad, m, s), self.signals | other.signals, "product")

    @property
    def coefficient_unit(self) -> str:
        """Unit of what the feature is multiplied with to give a torque."""
        def power(name: str, n: int) -> str:
            return name if n == 1 else f"{name}^{n}"

        up = ["N m", *(power(name, -n) for name, n in zip(BASE_UNITS, self.unit, strict=True) if n < 0)]
        down = [power(name, n) for name, n in zip(BASE_UNITS, self.unit, strict=True) if n > 0]
        return " ".join(up) + (f"/({' '.join(down)})" if len(down) > 1 else "".join(f"/{x}" for x in down))


def _simple(segment: Segment, towed: bool) -> list[tuple[Feature, Array]]:
    """The functions that products are made of, each (n,)."""
    made: list[tuple[Feature, Array]] = [(Feature("1", (0, 0, 0), frozenset(), "constant"), np.ones(len(segment)))]

    def add(name: str, unit: Exponents, signal: str, kind: str, x: Array) -> None:
        made.append((Feature(name, unit, frozenset([signal]), kind), x))

    for j in range(segment.n_links):
        q, qd, qdd, i = segment.q[:, j], segment.qd[:, j], segment.qdd[:, j], j + 1
        for name, x, unit in (("q", q, (1, 0, 0)), ("sin q", np.sin(q), (0, 0, 0)), ("cos q", np.cos(q), (0, 0, 0))):
            add(f"{name}{i}", unit, f"q{i}_rad", f"angle {i}", x)
        for name, x, unit in ((f"dq{i}", qd, (1, 0, -1)), (f"|dq{i}| dq{i}", np.abs(qd) * qd, (2, 0, -2)),
                              (f"sign(dq{i})", np.tanh(qd / SIGN_WIDTH), (0, 0, 0))):
            add(name, unit, f"dq{i}_rad_s", f"rate {i}", x)
        add(f"ddq{i}", (1, 0, -2), f"ddq{i}_rad_s2", f"acceleration {i}", qdd)
    if towed:
        add("u0", (0, 1, -1), "u0_m_s", "carriage", segment.u0)
        add("|u0| u0", (0, 2, -2), "u0_m_s", "carriage", np.abs(segment.u0) * segment.u0)
    add("t", (0, 0, 1), "time in the recording", "time", segment.t - segment.t[0])
    return made


def features(segment: Segment, place: float, needed: Sequence[str], towed: bool) -> tuple[list[Feature], Array]:
    """Return the features and their values (n, K): simple functions and products of two, each with a signal among `needed` (all: none).

    `place` is that of the recording in the campaign, 0 to 1; `towed` says whether the carriage moves in any recording.
    """
    order = Feature("place", (0, 0, 0), frozenset(["place in the campaign"]), "place")
    simple = [*_simple(segment, towed), (order, np.full(len(segment), place))]
    found = list(simple)
    for (a, x), (b, y) in combinations_with_replacement(simple[1:], 2):
        if a.kind != b.kind or (a is b and a.name[0] in "qtp"):
            found.append((a.times(b), x * y))
    wanted = {word.partition(" over the last ")[0] for word in needed}
    kept = [(f, x) for f, x in found if not wanted or f.name == "1" or f.signals & wanted]
    return [f for f, _ in kept], np.column_stack([x for _, x in kept])


@final
@dataclass(frozen=True)
class Suggested:
    """One term: its coefficient with a 95 % interval."""

    feature: Feature
    value: float
    ci95: tuple[float, float]

    def document(self) -> dict[str, Any]:
        """Return the term for diagnosis.json."""
        return {"term": self.feature.name, "value": self.value, "unit": self.feature.coefficient_unit, "ci95": list(self.ci95)}


@final
@dataclass(frozen=True)
class Suggestion:
    """A formula for the torque that remains at a joint, with the share it predicts on left-out recordings beside the learner's."""

    joint: int
    terms: tuple[Suggested, ...]
    r2: float
    learner: float

    def formula(self) -> str:
        """Return it as text."""
        def told(t: Suggested) -> str:
            number = f"{t.value:+.3g} {t.feature.coefficient_unit}"
            return f"{number[0]} {number[1:]}" + ("" if t.feature.name == "1" else f" · {t.feature.name}")

        return " ".join(told(t) for t in self.terms).removeprefix("+ ")

    def sentence(self) -> str:
        """Return the suggestion in words."""
        return (f"A suggestion, not a finding: what remains at joint {self.joint} goes like {self.formula()}, which predicts "
                f"{100 * self.r2:.0f} % of it on left-out recordings (a learner without physics: {100 * self.learner:.0f} %).")

    def document(self) -> dict[str, Any]:
        """Return the suggestion for diagnosis.json."""
        return {"joint": self.joint, "terms": [t.document() for t in self.terms], "r2": self.r2, "learner_r2": self.learner,
                "statement": self.sentence()}


@final
@dataclass(frozen=True, eq=False)
class _Sums:
    """Gram matrices (units, P, P) of [nuisance, features, torque] over all joints, and over the joint in question alone."""

    every: Array
    joint: Array
    prior: Array  # (nuisance,) precisions
    names: list[Feature]

    @cached_property
    def m(self) -> int:
        """Number of nuisance columns."""
        return len(self.prior)

    def reduced(self, units: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
        """Return, off the nuisance fitted to `units`, the features' Gram matrix, their products with the torque, and what maps coefficients
        (after a 1 for none) to the nuisance's values."""
        S, m = self.every[units].sum(axis=0), self.m
        A = S[:m, :m] + np.diag(self.prior + 1e-9 * np.diag(S)[:m] + 1e-12)
        B = np.linalg.solve(A, S[:m, m:])
        R = S[m:, m:] - S[m:, :m] @ B
        return R[:-1, :-1], R[:-1, -1], B

    def path(self, units: NDArray[np.bool_], most: int) -> list[Array]:
        """Return the coefficients (K,) of 1 to `most` terms, fitted to `units`."""
        from sklearn.linear_model import orthogonal_mp_gram

        G, g, _ = self.reduced(units)
        whole = np.diag(self.every[units].sum(axis=0))[self.m:-1]
        alive = np.flatnonzero(np.diag(G) > ALIVE * np.maximum(whole, 1e-300))
        if not len(alive):
            return []
        size = np.sqrt(np.diag(G)[alive])
        found = orthogonal_mp_gram(G[np.ix_(alive, alive)] / np.outer(size, size), g[alive] / size, n_nonzero_coefs=min(most, len(alive)),
                                   return_path=True)
        made = []
        for one in np.atleast_2d(np.asarray(found).reshape(len(alive), -1).T):
            c = np.zeros(len(G))
            c[alive] = one / size
            made.append(c)
        return made

    def on(self, support: NDArray[np.int64], units: NDArray[np.bool_]) -> Array:
        """Return the coefficients (K,) of the features `support`, fitted to `units`."""
        G, g, _ = self.reduced(units)
        c = np.zeros(len(G))
        c[support] = np.linalg.lstsq(G[np.ix_(support, support)], g[support], rcond=1e-12)[0]
        return c

    def squares(self, c: Array, fitted: NDArray[np.bool_], units: NDArray[np.bool_]) -> Array:
        """Return the squared error (units,) at the joint of coefficients `c`, the nuisance being that fitted to `fitted`."""
        B = self.reduced(fitted)[2]
        v = np.concatenate([-(B[:, -1] - B[:, :-1] @ c), -c, [1.0]])
        return np.asarray(np.maximum(np.einsum("p,upq,q->u", v, self.joint[units], v), 0.0), np.float64)


def _sums(race: Race, table: Table, believed: StripTheory, joint: int, needed: Sequence[str]) -> _Sums:
    moving = [piece for piece in table.pieces if piece.dt > 0]
    order = {number: place for place, number in enumerate(dict.fromkeys(piece.number for piece in moving))}
    columns, names = columns_of(race.chosen), list[Feature]()
    instances, segments = [c.instance for c in race.chosen], {id(p): table.case.all_units[p.number].segments()[p.k] for p in moving}
    towed = any(segment.u0.any() for segment in segments.values())
    every: Array = np.zeros((0, 0, 0))
    alone = every

    def beside(piece: Piece) -> tuple[list[Feature], Array]:
        segment = segments[id(piece)]
        made, F = features(segment, order[piece.number] / max(len(order) - 1, 1), needed, towed)
        return made, segment.seen(F)[kept_rows(segment)]

    for piece in moving:
        names, F = beside(piece)
        X = table.columns(piece, instances, believed)
        full = np.zeros((*piece.y.shape, piece.Y.shape[2] + X.shape[2] + F.shape[1] + 1))
        full[..., : piece.Y.shape[2]] = piece.Y
        full[..., piece.Y.shape[2]: piece.Y.shape[2] + X.shape[2]] = X
        full[:, joint - 1, piece.Y.shape[2] + X.shape[2]: -1] = F
        full[..., -1] = piece.y
        full /= race.noise[None, :, None]
        grams = np.einsum("njp,njq->jpq", full, full, optimize=True)
        if not every.size:
            every = np.zeros((len(order), *grams.shape[1:]))
            alone = np.zeros_like(every)
        every[order[piece.number]] += grams.sum(axis=0)
        alone[order[piece.number]] += grams[joint - 1]
    return _Sums(every, alone, np.concatenate([race.bench.prior, np.zeros(len(columns))]), names)


def suggested(race: Race, table: Table, believed: StripTheory, rest: Learned, seed: int) -> Suggestion | None:
    """Return a formula for what remains at a joint as the learner `rest` sees it; None where none predicts at least half as much.

    None, too, where a finding has values of each recording's own: what it leaves is no function of the state.
    """
    if not rest.real or own_of(race.chosen).size:
        return None
    sums = _sums(race, table, believed, rest.joint, rest.depends_on)
    n = len(sums.every)
    if n < FOLDS:
        return None
    fold = np.random.default_rng(seed).permutation(n) % FOLDS
    without, errors = np.zeros(n), np.full((TERMS, n), np.inf)
    for k in range(FOLDS):
        out = fold == k
        without[out] = sums.squares(np.zeros(len(sums.names)), ~out, out)
        for number, c in enumerate(sums.path(~out, TERMS)):
            errors[number, out] = sums.squares(c, ~out, out)
    r2 = 1 - errors.sum(axis=1) / max(float(without.sum()), 1e-300)
    best = float(r2.max())
    count = int(np.flatnonzero(r2 >= best - PLAIN * abs(best))[0])
    gains = np.log(without + 1e-300) - np.log(errors[count] + 1e-300)
    if r2[count] < max(REAL, SHARE * rest.r2) or sign_flip_p(gains) > P_LEFT_OUT:
        return None
    return Suggestion(rest.joint, _terms(sums, count), float(r2[count]), rest.r2)


def _terms(sums: _Sums, count: int) -> tuple[Suggested, ...]:
    """The terms fitted to all recordings, with intervals from leaving out one at a time, the largest torque first."""
    from scipy.special import stdtrit

    n = len(sums.every)
    every = np.ones(n, dtype=bool)
    support = np.flatnonzero(sums.path(every, count + 1)[count])
    c = sums.on(support, every)
    less = np.array([sums.on(support, np.arange(n) != k) for k in range(n)])
    half = float(stdtrit(n - 1, 0.975)) * np.sqrt((n - 1) / n * ((less - c) ** 2).sum(axis=0))
    size = c**2 * np.diag(sums.joint.sum(axis=0))[sums.m:-1]
    order = sorted(support.tolist(), key=lambda k: -size[k])
    return tuple(Suggested(sums.names[k], float(c[k]), (float(c[k] - half[k]), float(c[k] + half[k]))) for k in order)
