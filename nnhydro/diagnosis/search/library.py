"""The candidate library: hypotheses with their scaled columns, and what each gains beside a selection, all at once by Schur complement."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import LEAST_GAIN, RELEVANT, RHO
from nnhydro.diagnosis.model.evidence import Columns, Posterior, Whitened
from nnhydro.diagnosis.problem.design import Design
from nnhydro.diagnosis.problem.hypothesis import Hypothesis, Key
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
OWN_SCREENED = 40  # laws with values of each recording's own that are scored again after the first time


@final
@dataclass(frozen=True, eq=False)
class Library:
    """Hypotheses and their columns `X` (n, joints, K), each scaled so that 1 makes the torque's rms where it weighs most."""

    design: Design
    hypotheses: tuple[Hypothesis, ...]
    X: Array
    scale: Array  # (K,) value of the effect at a scaled value of 1
    counts: dict[Key, int] | None = None  # laws tried of every key at first: finer values of a law are no further laws

    @staticmethod
    def of(design: Design, hypotheses: Sequence[Hypothesis], model: StripTheory) -> "Library":
        """Return the library of `hypotheses`, instruments at the reading of `model`."""
        return Library.scaled(design, hypotheses, design.columns(hypotheses, model))

    @staticmethod
    def scaled(design: Design, hypotheses: Sequence[Hypothesis], X: Array) -> "Library":
        """Return the library of `hypotheses` with columns `X` (n, joints, K) in the units of their effects; `X` is used up.

        A column that moves no torque to speak of at any value within its physical bounds is empty: a wave along a link that is held.
        """
        rms = np.sqrt(np.einsum("njk,njk->jk", X, X) / design.time) / np.maximum(design.scale, 1e-300)[:, None]
        largest = rms.max(axis=0) if X.shape[2] else np.zeros(0)
        most = np.abs(np.array([span for h in hypotheses for span in h.bounds()]).reshape(-1, 2)).max(axis=1)
        felt = (largest > 0) & (largest * most > RELEVANT)
        scale = np.where(felt, 1.0 / np.maximum(largest, 1e-300), 0.0)
        return Library(design, tuple(hypotheses), np.multiply(X, scale, out=X), scale)

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """First column of every hypothesis, and one past the last."""
        return np.concatenate([[0], np.cumsum([h.width for h in self.hypotheses])]).astype(np.int64)

    def at(self, k: int) -> slice:
        """Return the columns of hypothesis `k`."""
        return slice(int(self.starts[k]), int(self.starts[k + 1]))

    def with_more(self, other: "Library", counts: dict[Key, int] | None = None) -> "Library":
        """Return this library with the hypotheses of `other` added; `counts` of laws a key, as at first where given."""
        return Library(self.design, self.hypotheses + other.hypotheses, np.concatenate([self.X, other.X], axis=2),
                       np.concatenate([self.scale, other.scale]), counts)

    @cached_property
    def key_counts(self) -> dict[Key, int]:
        """How many laws are tried of every key."""
        if self.counts is not None:
            return self.counts
        counts: dict[Key, int] = {}
        for h in self.hypotheses:
            counts[h.key] = counts.get(h.key, 0) + 1
        return counts

    def log_prior(self, k: int) -> float:
        """Return the log prior odds of hypothesis `k`: every key alike, every law of a key alike, every part of a campaign alike.

        A standard term of a joint is as probable as not: what machines have, few baselines hold. That a law acts in a part
        only is as improbable as a claim without the least gain.
        """
        h = self.hypotheses[k]
        part = 0.0 if h.activity is None else LEAST_GAIN + np.log(self._parts[h.key])
        odds = 0.0 if h.effect.standard else np.log(len(self.key_counts))
        return -float(odds + np.log(self.key_counts[h.key]) + part)

    @cached_property
    def _parts(self) -> Counter[Key]:
        """In how many parts of the campaign the laws of every key are tried."""
        return Counter(h.key for h in self.hypotheses if h.activity is not None)

    def bounds(self, k: int) -> tuple[Array, Array]:
        """Return the physical bounds (width,) of the scaled values of hypothesis `k`."""
        s = np.maximum(self.scale[self.at(k)], 1e-300)
        low, high = np.array(self.hypotheses[k].bounds(), dtype=float).reshape(-1, 2).T
        return low / s, high / s


def log_mass(low: Array, high: Array, mean: Array, sd: Array) -> Array:
    """Return log of the mass of N(mean, sd^2) within [low, high], elementwise."""
    from scipy.special import log_ndtr

    a, b = (low - mean) / sd, (high - mean) / sd
    flip = a > 0
    a, b = np.where(flip, -b, a), np.where(flip, -a, b)
    upper, lower = log_ndtr(b), log_ndtr(a)
    made: Array = upper + np.log1p(-np.exp(np.minimum(lower - upper, -1e-12)))
    return made


def bound_bonus(low: Array, high: Array, mean: Array, sd: Array) -> float:
    """Return how the cut at the physical bounds changes the log evidence: posterior mass within over prior mass within."""
    free = np.isinf(low) & np.isinf(high)
    if free.all():
        return 0.0
    sd = np.maximum(sd, 1e-12)
    gained = log_mass(low, high, mean, sd) - log_mass(low, high, np.zeros_like(mean), np.full_like(mean, RHO))
    return float(np.where(free, 0.0, np.maximum(gained, -1e6)).sum())


@final
@dataclass(eq=False)
class View:
    """A library whitened by one noise: products of all its columns with baseline, unknown and torque."""

    whitened: Whitened
    library: Library
    before: "View | None" = None  # of the same rows and noise, with fewer hypotheses: its products are taken over
    _columns: dict[int, Columns] = field(default_factory=dict)
    _bounds: dict[int, tuple[Array, Array, NDArray[np.bool_], Array]] = field(default_factory=dict)
    _own_best: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        shared = [k for k, h in enumerate(self.library.hypotheses) if not h.per_recording]
        self.shared = np.array(shared, dtype=int)
        self.own = np.array([k for k, h in enumerate(self.library.hypotheses) if h.per_recording], dtype=int)
        places = [np.arange(self.library.at(k).start, self.library.at(k).stop) for k in self.shared]
        at = np.concatenate(places) if shared else np.zeros(0, int)
        self.place = at.astype(int)
        self._multiply()
        self.before = None  # its columns are held here, too
        widths = [self.library.hypotheses[k].width for k in self.shared]
        self.starts = np.concatenate([[0], np.cumsum(widths)]).astype(int)
        self.widths = np.array(widths, dtype=int)

    def _multiply(self) -> None:
        old = self.before
        known = 0 if old is None else len(old.place)
        if old is not None and len(self.place) == known:  # what is new has values of each recording's own
            self.Xw: Array = old.Xw
            self.cross: Array = old.cross
            self.gram: Array = old.gram
            self.Xy: Array = old.Xy
            return
        X = self.library.X[..., self.place[known:]]
        Xw, cross = self.whitened.weighted(X), self.whitened.cross(X)
        flat = Xw.reshape(self.whitened.y.size, X.shape[2])
        gram, Xy = flat.T @ flat, flat.T @ self.whitened.y.ravel()
        if old is not None:
            between = old.Xw.reshape(-1, known).T @ flat
            Xw, cross = np.concatenate([old.Xw, Xw], axis=2), np.concatenate([old.cross, cross], axis=1)
            gram, Xy = np.block([[old.gram, between], [between.T, gram]]), np.concatenate([old.Xy, Xy])
        self.Xw, self.cross, self.gram, self.Xy = Xw, cross, gram, Xy

    def columns(self, k: int) -> Columns:
        """Return the columns of hypothesis `k`, one set a recording where its values are each recording's own."""
        if k not in self._columns and not self.library.hypotheses[k].per_recording:
            i = int(np.searchsorted(self.shared, k))
            at = slice(self.starts[i], self.starts[i + 1])
            self._columns[k] = Columns(self.Xw[..., at], self.cross[:, at], self.gram[at, at], self.Xy[at])
        if k not in self._columns:
            X = self.library.X[..., self.library.at(k)]
            if self.library.hypotheses[k].per_recording:
                group = self.library.design.problem.group_of
                used = [g for g in range(self.library.design.problem.groups) if np.any(X[group == g])]
                X = np.concatenate([X * (group == g)[:, None, None] for g in used], axis=2) if used else X
            self._columns[k] = Columns.of(self.whitened, X)
        return self._columns[k]

    def joined(self, chosen: Iterable[int]) -> Columns | None:
        """Return the columns of the hypotheses `chosen`, side by side; None where there are none."""
        made: Columns | None = None
        for k in chosen:
            made = self.columns(k) if made is None else made.joined(self.columns(k))
        return made

    def gains(self, columns: Columns | None, fit: Posterior) -> Array:
        """Return the log evidence (hypotheses,) that each adds to `fit` of `columns` at its sizes, the cut at bounds included."""
        gained = np.full(len(self.library.hypotheses), -np.inf)
        if len(self.place):
            self._shared_gains(columns, fit, gained)
        if len(self.own):
            self._own_gains(columns, fit, gained)
        return gained

    def _beside(self, columns: Columns | None, Xw: Array, cross: Array, fit: Posterior) -> Array:
        from scipy.linalg import solve_triangular

        if columns is not None:
            k = columns.Xw.shape[2]
            cross = np.concatenate([cross, columns.Xw.reshape(-1, k).T @ Xw.reshape(-1, Xw.shape[2])])
        made: Array = solve_triangular(fit.chol, cross * fit.scale[:, None], lower=True, check_finite=False)
        return made

    def _shared_gains(self, columns: Columns | None, fit: Posterior, gained: Array) -> None:
        C = self._beside(columns, self.Xw, self.cross, fit)
        c = self.Xy - C.T @ fit.half
        for width in np.unique(self.widths):
            which = np.flatnonzero(self.widths == width)
            at = self.starts[which][:, None] + np.arange(width)
            Ck = C[:, at.ravel()].reshape(-1, len(which), width)
            R = self.gram[at[:, :, None], at[:, None, :]] - np.einsum("nka,nkb->kab", Ck, Ck)
            M = RHO**2 * R + np.eye(width)
            ck = c[at]
            half = np.linalg.solve(M, ck[..., None])[..., 0]
            logdet = np.linalg.slogdet(M)[1]
            mean, spread = RHO**2 * half, RHO**2 * np.linalg.inv(M)
            sd = np.sqrt(np.maximum(np.diagonal(spread, axis1=1, axis2=2), 1e-24))
            low, high, free, before = self._limits(int(width))
            within = np.maximum(log_mass(low, high, mean, sd) - before, -1e6)
            gained[self.shared[which]] = 0.5 * (RHO**2 * (ck * half).sum(axis=1) - logdet) + np.where(free, 0.0, within).sum(axis=1)

    def _limits(self, width: int) -> tuple[Array, Array, NDArray[np.bool_], Array]:
        """Bounds (laws, width) of all laws with so many values, which of them are free, and the log mass of the prior within them."""
        if width not in self._bounds:
            pairs = [self.library.bounds(int(k)) for k in self.shared[np.flatnonzero(self.widths == width)]]
            low, high = np.array([a for a, _ in pairs]), np.array([b for _, b in pairs])
            before = log_mass(low, high, np.zeros_like(low), np.full_like(low, RHO))
            self._bounds[width] = low, high, np.isinf(low) & np.isinf(high), before
        return self._bounds[width]

    @cached_property
    def _own_parts(self) -> tuple[Array, Array, dict[int, slice], dict[int, tuple[Array, Array]]]:
        """Products of the columns with values of each recording's own: cross (groups, P, K), X'y (groups, K), places."""
        at, places = [], {}
        start = 0
        for k in self.own:
            s = self.library.at(k)
            at += list(range(s.start, s.stop))
            places[int(k)] = slice(start, start + s.stop - s.start)
            start += s.stop - s.start
        X = self.library.X[..., at]
        groups = self.library.design.problem.groups
        P = len(self.whitened.b)
        cross, Xy = np.zeros((groups, P, start)), np.zeros((groups, start))
        grams: dict[int, tuple[Array, Array]] = {}
        blocks = np.zeros((groups, start, max((s.stop - s.start for s in places.values()), default=1)))
        Xw = self.whitened.weighted(X)
        for g in range(groups):
            rows = np.flatnonzero(self.whitened.group == g)
            if not len(rows):
                continue
            cross[g] = self.whitened.cross(X, rows)
            part = Xw[rows].reshape(-1, start)
            Xy[g] = part.T @ self.whitened.y[rows].ravel()
            for s in places.values():
                blocks[g, s, : s.stop - s.start] = part[:, s].T @ part[:, s]
        grams[0] = (blocks, Xw)
        return cross, Xy, places, grams

    def _own_gains(self, columns: Columns | None, fit: Posterior, gained: Array) -> None:
        from scipy.linalg import solve_triangular

        cross, Xy, places, grams = self._own_parts
        blocks, Xw = grams[0]
        groups, P, K = cross.shape
        stacked = cross.transpose(1, 0, 2).reshape(P, groups * K)
        if columns is not None:
            k = columns.Xw.shape[2]
            more = np.zeros((k, groups, K))
            for g in range(groups):
                rows = np.flatnonzero(self.whitened.group == g)
                more[:, g] = columns.Xw[rows].reshape(-1, k).T @ Xw[rows].reshape(-1, K)
            stacked = np.concatenate([stacked, more.reshape(k, groups * K)])
        numbers = list(places)
        if len(self._own_best) == len(places) and len(places) > OWN_SCREENED:  # those that never gained much are not asked again
            numbers = sorted(places, key=lambda k: -self._own_best[k])[:OWN_SCREENED]
        kept = np.concatenate([np.arange(places[k].start, places[k].stop) for k in numbers])
        stacked = stacked.reshape(-1, groups, K)[:, :, kept].reshape(-1, groups * len(kept))
        C = solve_triangular(fit.chol, stacked * fit.scale[:, None], lower=True, check_finite=False).reshape(-1, groups, len(kept))
        c = Xy[:, kept] - np.einsum("pgk,p->gk", C, fit.half)
        start = 0
        for number in numbers:
            s, w = places[number], places[number].stop - places[number].start
            live = [g for g in range(groups) if blocks[g, s, :w].any()]
            if live:
                Ck = C[:, live, start:start + w].reshape(C.shape[0], -1)
                M = -RHO**2 * (Ck.T @ Ck)
                for i, g in enumerate(live):
                    M[i * w:(i + 1) * w, i * w:(i + 1) * w] += RHO**2 * blocks[g, s, :w]
                M[np.diag_indices_from(M)] += 1.0
                ck = c[live, start:start + w].ravel()
                gained[number] = 0.5 * (RHO**2 * ck @ np.linalg.solve(M, ck) - np.linalg.slogdet(M)[1])
            self._own_best[number] = max(self._own_best.get(number, -np.inf), float(gained[number]))
            start += w
