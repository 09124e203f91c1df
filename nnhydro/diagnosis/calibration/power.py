"""What a campaign can reveal: for each effect the smallest size that these motions and this noise would show, before anyone looks for it.

    S - 0.84 sqrt(2 S) + w/2 - log|M|/2 + log prior = threshold,    S = lambda^2 / 2 beside the unknown fitted to the effect's own torque
    visible share = ||W^1/2 (I - P_Y) x|| / ||W^1/2 x||

The left side is the gain in log evidence that four campaigns of five exceed: it scatters by lambda = sqrt(2 S), and chance adds half a nat
for each of w values. What the unknown takes is had by fitting it to the campaign with the effect put in at that size. The threshold is that
of the decision, LEAST_GAIN or chance in this campaign. Each linear parameter is taken alone, nonlinear ones at the values first tried; an
amplitude with a phase per recording is taken at even phases.
Source: power of a test by its noncentrality, Kay (1998), Fundamentals of Statistical Signal Processing II.
"""

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.decision.null_draws import least_gain, null_threshold
from nnhydro.diagnosis.model.evidence import Columns, Posterior, WhiteRows, posterior
from nnhydro.diagnosis.model.sizes import Sizes, fit_sizes, without_unknown
from nnhydro.diagnosis.model.unknown import unknown_of
from nnhydro.diagnosis.noise.spectrum import FIRST_SIZE, Noise, calibrated_noise
from nnhydro.diagnosis.problem.design import Design, hypotheses_for, relevant_share
from nnhydro.diagnosis.problem.hypothesis import Hypothesis
from nnhydro.diagnosis.problem.problem import MOST_STUDIED, draw_names, problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.campaign import Campaign

Array = NDArray[np.float64]
CHANCE, SIGMAS = 0.8, 0.84  # chance of finding an effect of the stated size, and the same in standard deviations of a normal
STARTS = (FIRST_SIZE, FIRST_SIZE / 10)  # sizes of the unknown from which its evidence is maximised
ROUNDS = 4  # iterations between the size of an effect and what the unknown takes of it
UNSEEN = 1e-6  # share of its energy that a torque keeps beside the baseline; with less it counts as recalibration


@final
@dataclass(frozen=True, eq=False)
class DetectableSize:
    """One parameter of one hypothesis: the smallest size that would be found, and what hides it."""

    hypothesis: Hypothesis
    parameter: str
    unit: str
    size: float | None  # None: no size within physical bounds would be found
    visible: float  # share of the torque that a refit of the baseline leaves
    strength: float | None  # lambda at that size, beside the baseline
    shape: dict[str, float]  # nonlinear parameters at which the size holds
    direction: Array  # (width,) of the linear values, for a size of 1
    rival: str | None = None  # effect whose torque is most alike beside the baseline
    likeness: float = 0.0

    def document(self) -> dict[str, Any]:
        """Return the row for `nnhydro power --json`."""
        effect = self.hypothesis.effect
        return {"effect": effect.id, "family": effect.family, "joint": effect.joint or None, "parameter": self.parameter,
                "unit": self.unit, "smallest_size": self.size, "visible_share": self.visible, "lambda": self.strength, "at": self.shape,
                "nearest": self.rival, "likeness": self.likeness}


@final
@dataclass(frozen=True, eq=False)
class Power:
    """What can be revealed in addition to the baseline of `design`, calibrated as `model`, with its noise."""

    design: Design
    noise: Noise
    model: StripTheory
    rows: list[DetectableSize]

    def document(self) -> dict[str, Any]:
        """Return what `nnhydro power --json` prints."""
        rms = np.sqrt(self.noise.noise_variance.sum(axis=0) / self.design.duration)
        return {"schema": "nnhydro/power/1", "baseline": self.design.baseline.name, "recordings": self.design.problem.groups,
                "noise_Nm": rms.tolist(), "chance": CHANCE, "effects": [row.document() for row in self.rows]}


def strength_needed(threshold: float, occam: float, width: int) -> float:
    """Return lambda whose gain exceeds `threshold` nats in four campaigns of five; `occam` nats are lost for `width` values."""
    return SIGMAS + float(np.sqrt(SIGMAS**2 + 2 * max(threshold + occam - width / 2, 0.0)))


def _directions(h: Hypothesis) -> Iterator[tuple[str, str, Array]]:
    """(parameter, unit, direction of size 1): every linear parameter alone, or an amplitude at an even phase."""
    effect, width = h.effect, h.width
    if h.per_recording and width > 1:
        even = torch.ones(width, dtype=torch.float64)
        name, quantity = next(iter(effect.with_linear(even).quantities().items()))
        yield name, quantity.unit, even.numpy() / quantity.value
        return
    for k, (name, unit) in enumerate(zip(effect.linear_names(), effect.linear_units(), strict=True)):
        yield name, unit, np.eye(width)[k]


def _within_bounds(h: Hypothesis, values: Array) -> bool:
    low, high = np.array(h.bounds, dtype=float).reshape(-1, 2).T
    return any(bool(((low - 1e-12 <= x) & (x <= high + 1e-12)).all()) for x in (values, -values))


def _projected_gram(columns: Columns, fit: Posterior) -> Array:
    """The Gram matrix (k, k) of what the fit of baseline and unknown leaves of the columns."""
    C = fit.projection(columns.cross)
    made: Array = columns.gram - C.T @ C
    return made


def _occam(R: Array) -> float:
    """The nats that columns with the Gram matrix R cost by their prior alone."""
    return 0.5 * float(np.linalg.slogdet(np.eye(len(R)) + RHO**2 * R)[1])


@final
@dataclass(eq=False)
class Sizing:
    """Sizes of effects beside baseline and unknown of one campaign."""

    view: WeightedLibrary
    null: ScoredSet
    chance: float

    def __post_init__(self) -> None:
        whitened = self.view.whitened
        self.alone = without_unknown(whitened, None)

    def row(self, k: int, name: str, unit: str, direction: Array) -> DetectableSize:
        """Return what is revealed of one parameter, without the unknown."""
        library = self.view.library
        h, columns = library.hypotheses[k], self.view.columns(k)
        shape = {n: float(getattr(h.effect, n)[0]) for n in h.spans if getattr(h.effect, n)}
        d = self.unit_values(k, direction)
        R = _projected_gram(columns, self.alone)
        whole, left = float(d @ columns.gram @ d), float(d @ R @ d)
        row = DetectableSize(h, name, unit, None, 0.0, None, shape, direction)
        if left <= UNSEEN * max(whole, 1e-300):
            return row
        strength = strength_needed(least_gain(library, self.chance, k) - library.log_prior(k), _occam(R), len(R))
        moved = np.sqrt(((library.columns(k) @ d[: h.width]) ** 2).sum(axis=0) / library.design.duration) / library.design.scale
        relevant = relevant_share(library.design, self.view.whitened.v)
        size = max(strength / np.sqrt(left), relevant / max(float(moved.max()), 1e-300) + SIGMAS / np.sqrt(left))
        return self._limit_size(replace(row, visible=float(np.sqrt(min(left / whole, 1.0)))), size, left)

    def unit_values(self, k: int, direction: Array) -> Array:
        """Return the scaled values of all its columns for a size of 1: the same in every recording where each has its own."""
        library = self.view.library
        d = direction / np.maximum(library.scale[library.at(k)], 1e-300)
        return np.tile(d, self.view.columns(k).Xw.shape[2] // len(d))

    @staticmethod
    def _limit_size(row: DetectableSize, size: float, left: float) -> DetectableSize:
        possible = _within_bounds(row.hypothesis, row.direction * size)
        return replace(row, size=size if possible else None, strength=float(size * np.sqrt(left)) if possible else None)

    def size_in_addition(self, k: int, row: DetectableSize) -> DetectableSize:
        """Return the row with the size that is needed if the unknown explains as much of the effect as it can."""
        if row.size is None:
            return row
        library, columns, size = self.view.library, self.view.columns(k), row.size
        d = self.unit_values(k, row.direction)
        left = float(d @ _projected_gram(columns, self.alone) @ d)
        R = _projected_gram(columns, self.null.fit)
        occam = _occam(R)
        needed = strength_needed(least_gain(library, self.chance, k) - library.log_prior(k), occam, len(R)) ** 2 / 2
        for _ in range(ROUNDS):
            shown = self._gain(columns, size * d) + occam
            step = float(np.clip(np.sqrt(needed / max(shown, 1e-3)), 0.5, 4.0))
            size *= step
            if abs(step - 1) < 0.02:
                break
        return self._limit_size(row, max(size, row.size), left)

    def _gain(self, columns: Columns, values: Array) -> float:
        """The log evidence that the columns gain where they are put in at `values`, beside the unknown fitted to that."""
        null, old = self.null.fit.mean, self.view.whitened
        seen: WhiteRows = copy(old)
        seen.b = old.G @ null + columns.cross @ values
        Xy = columns.cross.T @ null + columns.gram @ values
        seen.yy = float(null @ old.G @ null + 2 * null @ columns.cross @ values + values @ columns.gram @ values)
        law = posterior(seen, replace(columns, Xy=Xy), self.null.sizes.vector(seen)).log_evidence
        starts = (*(Sizes.even(seen, size) for size in STARTS), self.null.sizes)
        without = max(fit_sizes(seen, None, start)[0].log_evidence for start in starts)
        return law - without


def _typical(rows: Sequence[tuple[int, DetectableSize]]) -> tuple[int, DetectableSize]:
    """The row with the median size of the nonlinear values that are found at some size; of several laws, the law found earliest."""
    laws: dict[int, list[tuple[int, DetectableSize]]] = {}
    for k, row in rows:
        laws.setdefault(row.hypothesis.width, []).append((k, row))

    def size(candidate: tuple[int, DetectableSize]) -> float:
        return np.inf if candidate[1].size is None else candidate[1].size

    middle = []
    for law in laws.values():
        order = sorted(law, key=size)
        middle.append(order[max(sum(row.size is not None for _, row in law) - 1, 0) // 2])
    return min(middle, key=size)


def _with_rivals(sizing: Sizing, rows: Sequence[tuple[int, DetectableSize]]) -> list[DetectableSize]:
    """The rows with the other effect that explains most of what the baseline leaves of them, each effect at its typical values."""
    view, hypotheses = sizing.view, sizing.view.library.hypotheses
    shown = list(dict.fromkeys(k for k, row in rows if not row.hypothesis.per_recording))
    joined = view.join(shown)
    if joined is None:
        return [row for _, row in rows]
    H = _projected_gram(joined, sizing.alone)
    ends = np.cumsum([0, *(hypotheses[k].width for k in shown)])
    places = {k: np.arange(a, b) for k, (a, b) in zip(shown, pairwise(ends.tolist()), strict=True)}
    made = []
    for k, row in rows:
        best, name = 0.0, None
        if k in places and row.visible > 0:
            h, d = H[:, places[k]] @ sizing.unit_values(k, row.direction), sizing.unit_values(k, row.direction)
            for other, at in places.items():
                if hypotheses[other].effect.id != row.hypothesis.effect.id:
                    share = float(h[at] @ np.linalg.lstsq(H[np.ix_(at, at)], h[at], rcond=1e-9)[0] / (d @ h[places[k]]))
                    best, name = max((best, name), (share, hypotheses[other].effect.id), key=lambda pair: pair[0])
        made.append(replace(row, rival=name, likeness=float(np.sqrt(min(best, 1.0)))))
    return made


@one_thread()
def power(campaign: Campaign, baseline: str | None = None, seed: int = 0, cutoff_hz: float | None = None,
          without: Sequence[str] = (), progress: Callable[[str], None] = lambda line: None) -> Power:
    """Return what `campaign` would reveal beside `baseline`: a row per effect and parameter, with the most similar rival.

    Raises ConfigError for an unknown baseline, CampaignError or RecordingError where the data cannot be used.
    """
    design = design_on(problem_of(campaign, draw_names(campaign.names, MOST_STUDIED, seed), cutoff_hz), baseline)
    progress("estimating noise")
    noise, whitened, sizes, model = calibrated_noise(design, unknown_of(design, design.baseline.at(np.zeros(design.Y.shape[2]))))
    hypotheses = hypotheses_for(design, without)
    progress(f"computing {len(hypotheses)} hypotheses")
    search = Search(WeightedLibrary(whitened, Library.of(design, hypotheses, model)), sizes)
    null = search.score(())
    sizing = Sizing(search.view, null, null_threshold(search, null, seed))
    by_key: dict[tuple[str, int, str], list[tuple[int, DetectableSize]]] = {}
    for k, hypothesis in enumerate(hypotheses):
        for name, unit, direction in _directions(hypothesis):
            by_key.setdefault((*hypothesis.key, name), []).append((k, sizing.row(k, name, unit, direction)))
    typical = [_typical(rows) for rows in by_key.values()]
    made = []
    for number, (k, row) in enumerate(typical):
        progress(f"sizes: {number} of {len(typical)}")
        made.append((k, sizing.size_in_addition(k, row)))
    return Power(design, noise, model, _with_rivals(sizing, made))
