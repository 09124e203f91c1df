"""Errors on recordings held out of the fit, before and after, and the residuals that remain, in the band and on the rows of the problem.

    error = sum |tau - model| / sum |tau|,     where nothing is driven: / sum |largest known part of the model|

Every fold is predicted by values fitted to the others; the choice of effects has seen all of them. No prediction looks at measured torque.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.decision.heldout import fold_of_rows, unit_held_out
from nnhydro.diagnosis.model.evidence import Columns, WhiteRows, posterior
from nnhydro.diagnosis.model.sizes import none
from nnhydro.diagnosis.problem.design import Design
from nnhydro.diagnosis.problem.hypothesis import Key
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
MEASURED = "measured torque"  # what errors are divided by, unless nothing drives the machine


@final
@dataclass(frozen=True, eq=False)
class Residual:
    """The residual of one segment: `r` (n, joints) N m at `state` {name: (n,)}, rows `dt` s apart (0 for steady runs)."""

    recording: str
    r: Array
    state: dict[str, Array]
    dt: float


@final
@dataclass(frozen=True, eq=False)
class HeldoutErrors:
    """Errors on held-out recordings before and after, and without each finding, and the residuals of baseline and corrected model."""

    before: float
    after: float
    without: dict[Key, float]
    residuals: list[Residual]
    remains: list[Residual]
    torque: float  # mean of what errors are divided by, N m
    recordings: int
    scale: str = MEASURED
    unit: str = "recordings"  # what was held out: stretches where recordings are few, rows of steady tables
    as_given: float | None = None  # error of a simulation beside which nothing is recalibrated; physics of ours has none

    @property
    def driven(self) -> bool:
        """Whether a torque was measured."""
        return self.scale == MEASURED


def states(segment: Segment) -> dict[str, Array]:
    """Return the state variables (n,) of a segment by their column name."""
    return segment.joint_states() | ({"u0_m_s": segment.u0} if segment.u0.any() else {})


def _predict(search: Search, found: ScoredSet, X: Array | None, fold: NDArray[np.int64]) -> Array:
    """Return the rows (n, joints) of the model's part beyond the baseline at z = 0, each fold fitted to the others."""
    whole, columns = best_fit(search, found).whitened, best_fit(search, found).columns
    made = np.zeros_like(search.view.library.design.y)
    t = none(whole).vector(whole)
    for number in range(int(fold.max()) + 1):
        rows = np.flatnonzero(fold != number)
        part = WhiteRows(whole.design, whole.unknown, whole.v, rows)
        fit = posterior(part, None if columns is None else Columns.of(part, columns.Xw[rows]), t)
        out = fold == number
        made[out] = whole.design.Y[out] @ fit.mean[: whole.p]
        if X is not None:
            made[out] += X[out] @ fit.mean[len(whole.b):]
    return made


def _predictable_columns(search: Search, found: ScoredSet, model: StripTheory) -> Array | None:
    """Return the scaled columns (n, joints, k) of the set without a look at measured torque, in the order of its fit."""
    if not found.chosen:
        return None
    library, parts = search.view.library, []
    for k in found.chosen:
        h = library.hypotheses[k]
        X = library.design.columns([h], model, predicted=True) * library.scale[library.at(k)]
        if h.per_recording:
            group = library.design.problem.group_of
            X = np.concatenate([X * (group == g)[:, None, None] for g in range(library.design.problem.groups)
                                if np.any(library.columns(k)[group == g])], axis=2)
        parts.append(X)
    return np.concatenate(parts, axis=2)


def _in_time(design: Design, rows: Array) -> list[Array]:
    """The rows (n, joints) of each block in time."""
    problem = design.problem
    return [problem.inverse(block, rows[problem.block_of == i]) for i, block in enumerate(problem.blocks)]


def _residuals(design: Design, in_time: Sequence[Array]) -> list[Residual]:
    made = []
    for block, r in zip(design.problem.blocks, in_time, strict=True):
        stretch = design.problem.stretches[block.stretch]
        named = {name: x[block.start:block.stop] for name, x in states(stretch.segment).items()}
        made.append(Residual(stretch.name, r, named, 0.0 if block.steady else stretch.segment.dt))
    return made


def measure_errors(search: Search, found: ScoredSet, model: StripTheory, seed: int) -> HeldoutErrors:
    """Return the held-out errors of the claimed set `found`; `model` is what instruments read."""
    design = search.view.library.design
    unit = unit_held_out(search.view, found.chosen)
    fold = fold_of_rows(search.view, seed, unit)

    def remains(scored: ScoredSet) -> list[Array]:
        """Return what a set leaves of each block in time."""
        return _in_time(design, design.y - _predict(search, scored, _predictable_columns(search, scored, model), fold))

    def error(in_time: Sequence[Array]) -> float:
        """Return the error of a model that leaves `in_time`."""
        return float(sum(np.abs(x).sum() for x in in_time)) / max(divisor, 1e-300)

    before = remains(search.score(()))
    after = remains(found) if found.chosen else before
    count = sum(len(x) for x in before)
    if design.undriven:
        divisor, scale = float(design.part_scale.sum() * count), "weight" if design.heavy else "inertia"
    else:
        divisor, scale = float(sum(np.abs(x).sum() for x in _in_time(design, design.tau))), MEASURED
    rests = {k: found.without(k) for k in found.chosen}
    without = {search.key(k): error(remains(search.score(rest)) if rest else before) for k, rest in rests.items()}
    given = None if design.baseline.is_physics else error(_in_time(design, design.y))
    return HeldoutErrors(error(before), error(after), without, _residuals(design, before), _residuals(design, after),
                         divisor / max(count * design.y.shape[1], 1), design.problem.groups, scale, unit, as_given=given)


def fitted_error(search: Search, found: ScoredSet, heldout: HeldoutErrors) -> float:
    """Return the error of the set on all rows, fitted to all of them: the held-out error with any number of recordings."""
    fit = best_fit(search, found)
    left = _in_time(search.view.library.design, fit.residual / fit.whitened.sw)
    return float(sum(np.abs(x).sum() for x in left)) / max(heldout.torque * sum(x.size for x in left), 1e-300)


def noise_error(search: Search, heldout: HeldoutErrors, row_variance: Array) -> float:
    """Return the error of a perfect model: `row_variance` (n, joints) is the variance of the noise of every row."""
    problem, total = search.view.library.design.problem, 0.0
    for i, block in enumerate(problem.blocks):
        n = block.stop - block.start
        rows = row_variance[problem.block_of == i]
        variance = rows if block.steady else rows.sum(axis=0) / (n * problem.stretches[block.stretch].segment.dt)
        total += float(np.sqrt(2 / np.pi * variance).sum()) * (1 if block.steady else n)
    count = sum(b.stop - b.start for b in problem.blocks) * row_variance.shape[1]
    return float(total / max(heldout.torque * count, 1e-300))
