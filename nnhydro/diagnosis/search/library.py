"""The candidate library: hypotheses with their scaled columns, prior odds and bounds."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import LEAST_GAIN, RELEVANT, RHO
from nnhydro.diagnosis.problem.design import Design
from nnhydro.diagnosis.problem.hypothesis import Hypothesis, Key
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
COLUMNS_AT_A_TIME = 128  # columns multiplied at a time, which bounds the memory


@final
@dataclass(frozen=True, eq=False)
class Library:
    """Hypotheses and their columns in `parts` (n, joints, k), each scaled so that 1 makes the torque's rms where it weighs most, or
    `Design.left` times as much.

    A part holds the columns of consecutive hypotheses; libraries that grow out of one another share them.
    """

    design: Design
    hypotheses: tuple[Hypothesis, ...]
    parts: tuple[Array, ...]
    scale: Array  # (K,) value of the effect at a scaled value of 1
    counts: dict[Key, int] | None = None  # laws tried of every key at first: finer values of a law are no further laws

    @staticmethod
    def of(design: Design, hypotheses: Sequence[Hypothesis], model: StripTheory) -> "Library":
        """Return the library of `hypotheses`, instruments at the reading of `model`."""
        return Library.of_columns(design, hypotheses, design.columns(hypotheses, model))

    @staticmethod
    def of_columns(design: Design, hypotheses: Sequence[Hypothesis], X: Array) -> "Library":
        """Return the library of `hypotheses` with columns `X` (n, joints, K) in the units of their effects; `X` is used up.

        A column that moves no relevant torque at any value within its physical bounds is empty: a wave along a link that is held.
        """
        rms = np.sqrt(np.einsum("njk,njk->jk", X, X) / design.duration) / np.maximum(design.scale, 1e-300)[:, None]
        largest, share = (x.max(axis=0, initial=0.0) for x in (rms, rms / design.left[:, None]))
        most = np.abs(_spans(hypotheses)).max(axis=1)
        felt = (largest > 0) & (largest * most > RELEVANT)
        scale = np.where(felt, 1.0 / np.maximum(share, 1e-300), 0.0)
        return Library(design, tuple(hypotheses), (np.multiply(X, scale, out=X),), scale)

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """First column of every hypothesis, and one past the last."""
        return np.concatenate([[0], np.cumsum([hypothesis.width for hypothesis in self.hypotheses])]).astype(np.int64)

    def at(self, k: int) -> slice:
        """Return the columns of hypothesis `k`."""
        return slice(int(self.starts[k]), int(self.starts[k + 1]))

    def columns(self, first: int, last: int | None = None) -> Array:
        """Return the columns (n, joints, k) of the hypotheses from `first` to `last`, which lie in one part; by default of `first`."""
        start, stop = self.at(first).start, self.at(first if last is None else last).stop
        part = self._part(first)
        before = int(self._ends[part] - self.parts[part].shape[2])
        return self.parts[part][..., start - before: stop - before]

    def runs(self, numbers: Iterable[int]) -> Iterator[tuple[list[int], Array]]:
        """Yield the columns (n, joints, k) of the hypotheses `numbers`, in runs of neighbours, about `COLUMNS_AT_A_TIME` at a time."""
        run: list[int] = []
        for k in map(int, numbers):
            if run and (k != run[-1] + 1 or self._part(k) != self._part(run[0])
                        or self.starts[k] - self.starts[run[0]] >= COLUMNS_AT_A_TIME):
                yield run, self.columns(run[0], run[-1])
                run = []
            run.append(k)
        if run:
            yield run, self.columns(run[0], run[-1])

    def _part(self, k: int) -> int:
        return self._part_of[k]

    @cached_property
    def _part_of(self) -> list[int]:
        """The part that holds the columns of every hypothesis."""
        found: list[int] = np.searchsorted(self._ends, self.starts[:-1], side="right").tolist()
        return found

    @cached_property
    def _ends(self) -> NDArray[np.int64]:
        """One past the last column of every part."""
        return np.cumsum([part.shape[2] for part in self.parts]).astype(np.int64)

    def with_more(self, other: "Library", counts: dict[Key, int] | None = None) -> "Library":
        """Return this library with the hypotheses of `other` added; `counts` of laws a key, as at first where given."""
        return Library(self.design, self.hypotheses + other.hypotheses, self.parts + other.parts,
                       np.concatenate([self.scale, other.scale]), counts)

    @cached_property
    def key_counts(self) -> dict[Key, int]:
        """How many laws are tried of every key; what moves no torque in this campaign is not tried."""
        if self.counts is not None:
            return self.counts
        counts: dict[Key, int] = {}
        for k, hypothesis in enumerate(self.hypotheses):
            if self._is_felt(k):
                counts[hypothesis.key] = counts.get(hypothesis.key, 0) + 1
        return counts

    def _is_felt(self, k: int) -> bool:
        return bool(self.scale[self.at(k)].any())

    def log_prior(self, k: int) -> float:
        """Return the log prior odds of hypothesis `k`: equal for every key, every law of a key, and every part of a campaign.

        A standard term of a joint is as probable as not: what machines have, few baselines hold. Friction is in every joint: that there is
        none is as improbable as a claim without the least gain. So is that a law acts in a part only. Frequencies per recording were
        chosen from all in the band. A law that moves no torque has no prior probability.
        """
        if not self._is_felt(k):
            return -np.inf
        h = self.hypotheses[k]
        part = 0.0 if h.activity is None else LEAST_GAIN + h.activity.log_alternatives(self.design.problem.groups)
        odds = 0.0 if h.effect.standard else np.log(len(self.key_counts))
        return self.log_expected(k) - float(odds + np.log(self.key_counts.get(h.key, 1)) + part + h.log_tried)

    def log_expected(self, k: int) -> float:
        """Return by how much the log prior odds of hypothesis `k` exceed even ones: no chance gain counts that."""
        h = self.hypotheses[k]
        return LEAST_GAIN if h.effect.everywhere and h.activity is None else 0.0

    def bounds(self, k: int) -> tuple[Array, Array]:
        """Return the physical bounds (width,) of the scaled values of hypothesis `k`."""
        low, high = self.spans[:, self.at(k)]
        return low, high

    @cached_property
    def spans(self) -> Array:
        """Physical bounds (2, K) of all scaled values."""
        made: Array = _spans(self.hypotheses).T / np.maximum(self.scale, 1e-280)
        return made


def _spans(hypotheses: Iterable[Hypothesis]) -> Array:
    """The physical bounds (K, 2) of the values of `hypotheses`."""
    return np.array([span for hypothesis in hypotheses for span in hypothesis.bounds], dtype=float).reshape(-1, 2)


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
