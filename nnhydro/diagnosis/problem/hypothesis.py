"""Hypotheses: one effect at one joint (0: the whole arm) at one value of its nonlinear parameters, and finer ones later."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from math import sqrt
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.diagnosis.problem.activity import ActivityWindow
from nnhydro.diagnosis.problem.motion_range import MotionRange
from nnhydro.effects.catalogue import candidates, catalogue
from nnhydro.effects.effect import Effect, InstrumentEffect, LoadEffect
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.arm import Arm

AnyEffect = LoadEffect | InstrumentEffect
Span = tuple[float, float]
Key = tuple[str, int]
NOT_KNOWN = MotionRange()
LONG_GRID, COUNTED_GRID = 9, 50  # lengths of a grid between which every second value is tried at first; longer ones count teeth


@final
@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An effect with its nonlinear parameters; `spans` are their neighbouring values, `grid` how many were tried at first.

    An instrument effect with a `working_model` has its columns about its own values, on the reading of that model, nearly so if `rough`.
    Where values differ between recordings, `values_by_recording` has them by the number of the recording, and `lines` its frequencies, Hz;
    `log_tried` is the logarithm of how many sets of them there were to choose from. With an `activity` it acts only there.
    """

    effect: AnyEffect
    grid: int = 1
    spans: Mapping[str, Span] = field(default_factory=dict)
    working_model: StripTheory | None = None
    activity: ActivityWindow | None = None
    rough: bool = False
    values_by_recording: Mapping[int, Tensor] = field(default_factory=dict)
    lines: Mapping[int, float] = field(default_factory=dict)
    log_tried: float = 0.0

    @property
    def key(self) -> Key:
        """What is claimed: effect and joint."""
        return self.effect.id, self.effect.joint

    @property
    def law(self) -> tuple[str, int, int]:
        """The law of the effect: with how many linear parameters."""
        return *self.key, self.width

    @cached_property
    def width(self) -> int:
        """Number of columns: one per linear parameter, and one for the constant of an effect with a random intercept."""
        return len(self.effect.linear_names()) + self.effect.random_intercept

    @property
    def per_recording(self) -> bool:
        """Whether the linear parameters have values of their own in every recording (a phase)."""
        return self.effect.per_recording

    @property
    def differs_between_recordings(self) -> bool:
        """Whether it differs between recordings: it has values per recording, or acts in some of them only."""
        return self.per_recording or (self.activity is not None and self.activity.sector is None)

    @cached_property
    def bounds(self) -> tuple[Span, ...]:
        """The physical bounds of each column's value; a constant has none."""
        return (*self.effect.linear_bounds(), *((float("-inf"), float("inf")),) * self.effect.random_intercept)

    def plausible(self, values: NDArray[np.float64]) -> bool:
        """Return whether the effect with linear `values` (p,) makes physical sense."""
        if type(self.effect).plausible is Effect.plausible:
            return True
        return self.with_values(torch.from_numpy(np.array(values, dtype=float))).plausible()

    def with_values(self, values: Tensor) -> AnyEffect:
        """Return the effect with linear `values` (at least p,) in the order of its columns."""
        return self.effect.with_linear(values[: len(self.effect.linear_names())])

    def with_nonlinear(self, values: Mapping[str, Any], spans: Mapping[str, Span]) -> "Hypothesis":
        """Return the hypothesis with other nonlinear `values`, tuples by name, and their neighbours `spans`."""
        return replace(self, effect=replace(self.effect, **values), spans={**self.spans, **spans})

    def effect_in(self, group: int) -> AnyEffect:
        """Return the effect in the recording of number `group`: with its own values where it has such."""
        effect = self.with_values(self.values_by_recording[group]) if group in self.values_by_recording else self.effect
        at_line: dict[str, Any] = {"frequency": (self.lines[group],)} if group in self.lines else {}
        return replace(effect, **at_line) if at_line else effect

    def linearised_at(self, values: Mapping[int, Tensor], model: StripTheory) -> "Hypothesis":
        """Return an instrument hypothesis with its columns about `values` on the reading of `model`; loads are linear as they are.

        `values` are those of each recording by its number where they are its own, else the one set of all, of number 0.
        """
        if not isinstance(self.effect, InstrumentEffect):
            return self
        if self.per_recording:
            return replace(self, values_by_recording=dict(values), working_model=model, rough=False)
        return replace(self, effect=self.with_values(values[0].to(torch.float64)), working_model=model, rough=False)


def grid_neighbours(values: Sequence[float], value: float) -> Span:
    """Return the grid points beside `value`; beyond an end as far as the other neighbour, in ratio where all are positive."""
    listed = sorted(set(values))
    k = listed.index(value)
    if len(listed) == 1:
        return value, value
    low, high = (listed[k + step] if 0 <= k + step < len(listed) else None for step in (-1, 1))
    if listed[0] > 0:
        return low or value**2 / (high or value), high or value**2 / (low or value)
    return (2 * value - high if low is None and high is not None else low or 0.0,
            2 * value - low if high is None and low is not None else high or 0.0)


def _details(effect: AnyEffect, ranges: tuple[float, ...], reverses: tuple[bool, ...]) -> dict[str, tuple[float, ...]]:
    """The values of the parameters that refine its shape; angles are smaller where its joint turns through less than a radian."""
    scale = min(1.0, ranges[effect.joint - 1] or 1.0) if ranges and effect.joint else 1.0
    hidden = effect.shown_by_reversals if reverses and effect.joint and not reverses[effect.joint - 1] else ()
    units = {field.name: field.metadata["unit"] for field in effect.parameters()}
    return {name: tuple((scale if units[name] == "rad" else 1.0) * value for value in values)
            for name, values in effect.details().items() if name not in hidden}


def _shapes(effect: AnyEffect, details: Mapping[str, Sequence[float]]) -> Iterator[AnyEffect]:
    """The effect, and with each value of the parameters that refine its shape."""
    yield effect
    for point in product(*details.values()):
        if details:
            values: dict[str, Any] = {name: (value,) for name, value in zip(details, point, strict=True)}
            yield replace(effect, **values)


def _thin(points: Sequence[AnyEffect], grids: Mapping[str, Sequence[float]]) -> list[AnyEffect]:
    """Return the points with every second value of a long grid: refinement finds the values between."""
    coarse = {name: set(grid[::2]) for name, grid in grids.items() if LONG_GRID <= len(grid) < COUNTED_GRID}
    return [point for point in points if all(getattr(point, name)[0] in values for name, values in coarse.items() if getattr(point, name))]


def _about_means(effect: AnyEffect, motion: MotionRange) -> AnyEffect:
    """Return the effect as a law about the mean angles and Reynolds numbers of the campaign."""
    effect = effect.centre(motion.means) if motion.means else effect
    return effect if motion.reynolds is None else effect.at_reynolds(*motion.reynolds)


def _shows(effect: AnyEffect, motion: MotionRange) -> bool:
    """Return whether a joint turns far enough and slowly enough for the effect to show."""
    j = effect.joint - 1
    far = not motion.angles or effect.narrowest() <= motion.angles[j]
    return j < 0 or (far and (not motion.slowest or effect.slowest() >= motion.slowest[j]))


def enumerate_hypotheses(arm: Arm, peaks: tuple[float, ...], without: Sequence[str] = (), driven: bool = True,
                         motion: MotionRange = NOT_KNOWN) -> tuple[Hypothesis, ...]:
    """Return every hypothesis that makes sense for the arm; `peaks` (joints,) N m, the largest torques measured.

    What is periodic in an angle shows in one period at least. Laws of an angle are written about its mean, those of the Reynolds number
    about its mean in the campaign. Where the arm is not `driven`, no effect that acts on a drive or its sensor can show: these are left
    out. Some are of free bodies alone.
    """
    made: list[Hypothesis] = []
    for cls in catalogue().values():
        if cls.id in without or (driven and not cls.driven) or (not driven and issubclass(cls, InstrumentEffect) and cls.stage > 0):
            continue
        scaled = {name: tuple(share * max(peaks) for share in grid) if name in cls.torque_scaled else grid
                  for name, grid in cls.grids().items()}
        points = [_about_means(point, motion)
                  for point in candidates(cls, arm, peaks, motion.rates) if isinstance(point, LoadEffect | InstrumentEffect)]
        points = points if cls.torque_scaled else _thin(points, scaled)
        points = [point for point in points if _shows(point, motion)]
        tried = {joint: _values_at(points, joint) for joint in {point.joint for point in points}}
        for point in points:
            reverses = motion.reverses if driven else (False,) * arm.n_links  # the zero of a free body's angle looks like presliding
            details = _details(point, motion.angles, reverses)
            grids = cls.grids() | {name: (0.0, *values) for name, values in details.items()}
            count, values = tried[point.joint]
            for effect in _shapes(point, details):
                spans = {name: grid_neighbours([*values[name], *(grids[name] if name in details else ())], getattr(effect, name)[0])
                         for name in grids
                         if getattr(effect, name) and (any(getattr(effect, name)) or name not in effect.shown_by_reversals)}
                made.append(Hypothesis(effect, count, spans))
    return tuple(made)


def _values_at(points: Sequence[AnyEffect], joint: int) -> tuple[int, dict[str, set[float]]]:
    """How many of `points` are at `joint`, and the values of each nonlinear parameter that they have."""
    same = [point for point in points if point.joint == joint]
    return len(same), {name: {x for point in same for x in getattr(point, name)[:1]} for name in same[0].grids()}


def _half_way(low: float, high: float) -> float:
    return sqrt(low * high) if low > 0 else (low + high) / 2


def refine_grid(hypothesis: Hypothesis) -> tuple[Hypothesis, ...]:
    """Return hypotheses half-way to the neighbouring values of each nonlinear parameter, within its bounds, and this one between them."""
    effect, spans, made = hypothesis.effect, dict(hypothesis.spans), []
    limits = {declaration.name: declaration.metadata["bounds"] for declaration in effect.parameters()}
    for name, (low, high) in hypothesis.spans.items():
        value = getattr(effect, name)[0]
        below, above = _half_way(low, value), _half_way(value, high)
        spans[name] = (below, above)
        for point, (near, far) in ((below, (low, value)), (above, (value, high))):
            if point != value and limits[name][0] <= point <= limits[name][1]:
                changes: dict[str, Any] = {name: (point,) * len(getattr(effect, name))}
                narrower = (_half_way(near, point), _half_way(point, far))
                made.append(replace(hypothesis, effect=replace(effect, **changes), spans={**hypothesis.spans, name: narrower}))
    return (replace(hypothesis, spans=spans), *made)
