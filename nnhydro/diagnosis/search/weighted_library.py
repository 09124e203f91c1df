"""The library weighted by one noise: products of its columns, computed on demand, and the gain of each law beside a set (Schur complement).

    cross = A'W X,   X_k'W X,   X'W y        W: inverse of the noise, A: baseline and unknown

The library stores each column once, unweighted. Only the columns of a set are whitened; all others enter products.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.model.evidence import Columns, Posterior, WhiteRows, added_evidence
from nnhydro.diagnosis.search.library import COLUMNS_AT_A_TIME, Library, log_mass

Array = NDArray[np.float64]
PER_RECORDING_SCREENED = 40  # laws with values for each recording that are screened again after the first time


class Alike(NamedTuple):
    """The laws of one number of values: their numbers among the shared, places, Gram matrices, bounds, and the prior's mass in these."""

    which: NDArray[np.int64]
    at: NDArray[np.int64]  # (laws, width)
    gram: Array  # (laws, width, width)
    low: Array
    high: Array
    free: NDArray[np.bool_]
    before: Array  # log mass of the prior within the bounds


class PerRecordingProducts(NamedTuple):
    """Products of the columns (K) with values per recording, one recording at a time."""

    cross: Array  # (P, groups, K)
    Xy: Array  # (groups, K)
    blocks: Array  # (groups, K, widest): the Gram matrix of each law, row by row
    places: dict[int, slice]


@final
@dataclass(eq=False)
class WeightedLibrary:
    """A library beside one noise; `cross` (P, K), `Xy` (K,) and `grams` (width, width) are of the laws `shared` by all recordings."""

    whitened: WhiteRows
    library: Library
    before: "WeightedLibrary | None" = None  # of the same rows and noise, with fewer hypotheses: its products are taken over
    _columns: dict[int, Columns] = field(default_factory=dict)
    _between: dict[int, Array] = field(default_factory=dict)
    _per_recording_between: dict[int, Array] = field(default_factory=dict)
    _drawn: dict[int, tuple[Array, Array]] = field(default_factory=dict)
    _per_recording_best: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        hypotheses = self.library.hypotheses
        varies = np.array([hypothesis.per_recording for hypothesis in hypotheses], dtype=bool)
        self.shared, self.per_recording = np.flatnonzero(~varies), np.flatnonzero(varies)
        self.widths = np.array([hypotheses[k].width for k in self.shared], dtype=int)
        self.starts = np.concatenate([[0], np.cumsum(self.widths)]).astype(int)
        self._multiply()
        self.before = None

    def _multiply(self) -> None:
        old = self.before
        self.grams: list[Array] = [] if old is None else list(old.grams)
        cross = [np.zeros((len(self.whitened.b), 0)) if old is None else old.cross]
        Xy = [np.zeros(0) if old is None else old.Xy]
        for numbers, X in self.library.runs(self.shared[len(self.grams):]):
            some = Columns.of(self.whitened, self.whitened.weigh(X))
            ends = np.cumsum([0, *(self.library.hypotheses[k].width for k in numbers)])
            self.grams += [some.gram[a:b, a:b].copy() for a, b in pairwise(ends.tolist())]
            cross.append(some.cross)
            Xy.append(some.Xy)
        self.cross: Array = np.concatenate(cross, axis=1)
        self.Xy: Array = np.concatenate(Xy)

    def products(self, rows: Array) -> Array:
        """Return the products (k, K) of whitened rows (n, joints, k) with the columns of all shared laws."""
        weighted = self.whitened.weigh(rows).reshape(-1, rows.shape[2]).T
        made = [weighted @ X.reshape(weighted.shape[1], X.shape[2]) for _, X in self.library.runs(self.shared)]
        return np.concatenate(made, axis=1) if made else np.zeros((rows.shape[2], 0))

    def columns(self, k: int) -> Columns:
        """Return the columns of hypothesis `k`, one set per recording if it has values per recording."""
        if k not in self._columns:
            X = self.library.columns(k)
            if self.library.hypotheses[k].per_recording:
                group, acting = self.library.design.problem.group_of, self.acting_groups(k)
                X = np.concatenate([X * (group == g)[:, None, None] for g in acting], axis=2) if acting else X
                self._columns[k] = Columns.of(self.whitened, self.whitened.weigh(X))
            else:
                i = int(np.searchsorted(self.shared, k))
                at = slice(self.starts[i], self.starts[i + 1])
                self._columns[k] = Columns(self.whitened.weigh(X), self.cross[:, at], self.grams[i], self.Xy[at])
        return self._columns[k]

    def acting_groups(self, k: int) -> list[int]:
        """Return the numbers of the recordings in which hypothesis `k` moves any torque, in the order of their values."""
        X, group = self.library.columns(k), self.library.design.problem.group_of
        return [g for g in range(self.library.design.problem.groups) if np.any(X[group == g])]

    def join(self, chosen: Iterable[int]) -> Columns | None:
        """Return the columns of the hypotheses `chosen`, side by side; None where there are none."""
        made: Columns | None = None
        for k in chosen:
            made = self.columns(k) if made is None else made.join(self.columns(k))
        return made

    def between(self, k: int) -> Array:
        """Return the products (k, K) of the columns of hypothesis `k` with those of all shared laws."""
        if k not in self._between:
            self._between[k] = self.products(self.columns(k).Xw)
        return self._between[k]

    def projection(self, chosen: Sequence[int], fit: Posterior) -> Array:
        """Return C (l, K): what `fit` of the hypotheses `chosen` takes of the shared columns is C'C."""
        return fit.projection(np.concatenate([self.cross, *map(self.between, chosen)]))

    @staticmethod
    def remainders(laws: Alike, C: Array) -> Array:
        """Return the Gram matrices (laws, width, width) of what a fit with the projection C (l, K) leaves of each law."""
        Ck = C[:, laws.at.ravel()].reshape(len(C), *laws.at.shape)
        made: Array = laws.gram - np.einsum("nka,nkb->kab", Ck, Ck)
        return made

    def noise_draws(self, seed: int, draws: int) -> tuple[Array, Array]:
        """Return rows (n, joints, draws) of noise of unit size and their products (draws, K) with the shared columns."""
        if seed not in self._drawn:
            e = np.random.default_rng(seed).standard_normal((*self.whitened.y.shape, draws))
            self._drawn[seed] = e, self.products(e)
        return self._drawn[seed]

    def gains(self, chosen: Sequence[int], fit: Posterior) -> Array:
        """Return the log evidence (hypotheses,) that each adds to `fit` of `chosen` at its sizes, the cut at bounds included."""
        gained = np.full(len(self.library.hypotheses), -np.inf)
        if len(self.shared):
            self._shared_gains(chosen, fit, gained)
        if len(self.per_recording):
            self._per_recording_gains(chosen, fit, gained)
        return gained

    def _shared_gains(self, chosen: Sequence[int], fit: Posterior, gained: Array) -> None:
        C = self.projection(chosen, fit)
        c = self.Xy - C.T @ fit.half
        for width, laws in self.alike.items():
            M = RHO**2 * self.remainders(laws, C) + np.eye(width)
            ck = c[laws.at]
            half, gain = added_evidence(M, ck)
            mean, spread = RHO**2 * half, RHO**2 * np.linalg.inv(M)
            sd: Array = np.sqrt(np.maximum(np.diagonal(spread, axis1=1, axis2=2), 1e-24))
            within = np.where(laws.free, 0.0, np.maximum(log_mass(laws.low, laws.high, mean, sd) - laws.before, -1e6))
            gained[self.shared[laws.which]] = gain + within.sum(axis=1)

    @cached_property
    def alike(self) -> dict[int, Alike]:
        """The shared laws by their number of values."""
        made = {}
        for width in np.unique(self.widths).tolist():
            which = np.flatnonzero(self.widths == width)
            pairs = [self.library.bounds(int(k)) for k in self.shared[which]]
            low, high = np.array([a for a, _ in pairs]), np.array([b for _, b in pairs])
            before = log_mass(low, high, np.zeros_like(low), np.full_like(low, RHO))
            made[width] = Alike(which, self.starts[which][:, None] + np.arange(width), np.stack([self.grams[i] for i in which]),
                                low, high, np.isinf(low) & np.isinf(high), before)
        return made

    @cached_property
    def _rows_of(self) -> list[NDArray[np.int64]]:
        """The rows of every recording."""
        return [np.flatnonzero(self.whitened.group == g) for g in range(self.library.design.problem.groups)]

    @cached_property
    def _per_recording_products(self) -> PerRecordingProducts:
        """Products of the columns with values per recording."""
        hypotheses, groups = self.library.hypotheses, len(self._rows_of)
        ends = np.cumsum([0, *(hypotheses[k].width for k in self.per_recording)]).tolist()
        places = {int(k): slice(a, b) for k, (a, b) in zip(self.per_recording, pairwise(ends), strict=True)}
        cross, Xy = np.zeros((len(self.whitened.b), groups, ends[-1])), np.zeros((groups, ends[-1]))
        blocks = np.zeros((groups, ends[-1], max(hypotheses[k].width for k in self.per_recording)))
        for numbers, X in self.library.runs(self.per_recording):
            Xw, at = self.whitened.weigh(X), slice(places[numbers[0]].start, places[numbers[-1]].stop)
            for g, rows in enumerate(self._rows_of):
                part = Xw[rows]
                flat = part.reshape(part.shape[0] * part.shape[1], part.shape[2])
                cross[:, g, at], Xy[g, at] = self.whitened.cross(part, rows), flat.T @ self.whitened.y[rows].ravel()
                for s in (places[k] for k in numbers):
                    law = flat[:, s.start - at.start: s.stop - at.start]
                    blocks[g, s, : law.shape[1]] = law.T @ law
        return PerRecordingProducts(cross, Xy, blocks, places)

    def _products_per_recording(self, k: int) -> Array:
        """Return the products (k, groups, K) of the columns of hypothesis `k` with those with values per recording."""
        if k not in self._per_recording_between:
            weighted = self.whitened.weigh(self.columns(k).Xw)
            parts = [weighted[rows].reshape(-1, weighted.shape[2]).T for rows in self._rows_of]
            runs = [np.stack([part @ X[rows].reshape(part.shape[1], X.shape[2]) for part, rows in zip(parts, self._rows_of, strict=True)],
                             axis=1) for _, X in self.library.runs(self.per_recording)]
            self._per_recording_between[k] = np.concatenate(runs, axis=2)
        return self._per_recording_between[k]

    def _per_recording_gains(self, chosen: Sequence[int], fit: Posterior, gained: Array) -> None:
        places, groups = self._per_recording_products.places, len(self._rows_of)
        numbers = list(places)
        if len(self._per_recording_best) == len(places) and len(places) > PER_RECORDING_SCREENED:  # the rest never gained much
            numbers = sorted(places, key=lambda k: -self._per_recording_best[k])[:PER_RECORDING_SCREENED]
        together = max(1, COLUMNS_AT_A_TIME // groups)
        for start in range(0, len(numbers), together):
            self._enter_per_recording_gains(numbers[start:start + together], chosen, fit, gained)

    def _enter_per_recording_gains(self, numbers: Sequence[int], chosen: Sequence[int], fit: Posterior, gained: Array) -> None:
        """Enter what each of the laws `numbers` with values per recording adds to `fit` of `chosen`."""
        cross, Xy, blocks, places = self._per_recording_products
        wanted = np.concatenate([np.arange(places[k].start, places[k].stop) for k in numbers])
        stacked = np.concatenate([part[..., wanted] for part in (cross, *map(self._products_per_recording, chosen))])
        C = fit.projection(stacked.reshape(len(stacked), -1)).reshape(-1, *stacked.shape[1:])
        c = Xy[:, wanted] - np.einsum("pgk,p->gk", C, fit.half)
        ends = np.cumsum([0, *(places[k].stop - places[k].start for k in numbers)]).tolist()
        alike: dict[tuple[int, bytes], list[int]] = {}  # laws of the same width that act in the same recordings
        for i, k in enumerate(numbers):
            alike.setdefault((ends[i + 1] - ends[i], blocks[:, places[k]].any(axis=(1, 2)).tobytes()), []).append(i)
        for (w, acts), laws in alike.items():
            live = np.flatnonzero(np.frombuffer(acts, dtype=bool))
            if len(live):
                at = np.array([ends[i] for i in laws])[:, None] + np.arange(w)  # (laws, w)
                Ck = C[:, live][:, :, at].transpose(2, 0, 1, 3).reshape(len(laws), len(C), -1)
                M = -RHO**2 * (Ck.transpose(0, 2, 1) @ Ck)
                for i, g in enumerate(live):
                    M[:, i * w:(i + 1) * w, i * w:(i + 1) * w] += RHO**2 * np.stack([blocks[g, places[numbers[j]], :w] for j in laws])
                M += np.eye(M.shape[1])
                ck = c[live][:, at].transpose(1, 0, 2).reshape(len(laws), -1)
                gained[np.array(numbers)[laws]] = added_evidence(M, ck)[1]
        for k in numbers:
            self._per_recording_best[k] = max(self._per_recording_best.get(k, -np.inf), float(gained[k]))
