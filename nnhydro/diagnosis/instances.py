"""The hypotheses of the bank: one instance for every effect, joint and value of its nonlinear parameters, and finer ones later."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import sqrt
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.diagnosis.spell import Spell
from nnhydro.effects.catalogue import candidates, catalogue
from nnhydro.effects.effect import Effect, InstrumentEffect, LoadEffect
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.arm import Arm

Hypothesis = LoadEffect | InstrumentEffect
Span = tuple[float, float]
Key = tuple[str, int]


@final
@dataclass(frozen=True, eq=False)
class Instance:
    """One hypothesis at one joint (0: the arm) and one value of its nonlinear parameters.

    `grid` is the number of values tried at first; `spans` are the neighbouring values of each nonlinear parameter. A settled instance of an
    instrument effect has its columns about its own values, on the reading of the model `believed` beside it.
    With a `spell` it acts only there. `start` marks settled values that nobody has fitted yet.
    """

    effect: Hypothesis
    grid: int = 1
    spans: Mapping[str, Span] = field(default_factory=dict)
    believed: StripTheory | None = None
    spell: Spell | None = None
    start: bool = False  # values from which a search starts: too flexible to tell what noise is

    @property
    def key(self) -> Key:
        """What is claimed: effect and joint."""
        return self.effect.id, self.effect.joint

    @cached_property
    def width(self) -> int:
        """Number of columns: one a linear parameter, one more for an offset of each recording's own."""
        return len(self.effect.linear_names()) + self.effect.offset_of_its_own

    @property
    def own(self) -> tuple[int, ...]:
        """Which of its columns have a value of their own in every recording."""
        if self.effect.own_in_every_recording:
            return tuple(range(self.width))
        return (self.width - 1,) if self.effect.offset_of_its_own else ()

    def bounds(self) -> tuple[Span, ...]:
        """Return the physical bounds of each column's value; an offset of a recording's own has none."""
        free = (float("-inf"), float("inf"))
        return (*self.effect.linear_bounds(), *(free,) * self.effect.offset_of_its_own)

    def plausible(self, values: NDArray[np.float64]) -> bool:
        """Return whether the effect with linear `values` (p,) makes sense."""
        if type(self.effect).plausible is Effect.plausible:  # most say nothing: spare them an object a candidate
            return True
        return self.with_values(torch.from_numpy(values.copy())).plausible()

    def with_values(self, values: Tensor) -> Hypothesis:
        """Return the effect with linear `values` (at least p,) in the order of its columns."""
        return self.effect.with_linear(values[: len(self.effect.linear_names())])


def beside(values: Sequence[float], value: float) -> Span:
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


def instances(arm: Arm, peaks: tuple[float, ...], without: Sequence[str] = ()) -> tuple[Instance, ...]:
    """Return every instance of every effect that makes sense for the arm; `peaks` (joints,) N m, the largest torques measured."""
    made: list[Instance] = []
    for cls in catalogue().values():
        if cls.id in without:
            continue
        found = [one for one in candidates(cls, arm, peaks) if isinstance(one, LoadEffect | InstrumentEffect)]
        for one in found:
            same = [other for other in found if other.joint == one.joint]
            spans = {name: beside([getattr(other, name)[0] for other in same], getattr(one, name)[0]) for name in cls.grids()}
            made.append(Instance(one, len(same), spans))
    return tuple(made)


def _half_way(low: float, high: float) -> float:
    return sqrt(low * high) if low > 0 else (low + high) / 2


def finer(instance: Instance) -> tuple[Instance, ...]:
    """Return instances half-way to the neighbouring values of each nonlinear parameter, and the instance itself between them."""
    effect, spans, made = instance.effect, dict(instance.spans), []
    limits = {f.name: f.metadata["bounds"] for f in effect.parameters()}
    for name, (low, high) in instance.spans.items():
        value = getattr(effect, name)[0]
        below, above = _half_way(low, value), _half_way(value, high)
        spans[name] = (below, above)
        for point, around in ((below, (low, value)), (above, (value, high))):
            if point != value and limits[name][0] <= point <= limits[name][1]:
                changes: dict[str, Any] = {name: (point,) * len(getattr(effect, name))}
                narrower = (_half_way(around[0], point), _half_way(point, around[1]))
                made.append(replace(instance, effect=replace(effect, **changes), spans={**instance.spans, name: narrower}))
    return (replace(instance, spans=spans), *made)


def settled(instance: Instance, values: Tensor, believed: StripTheory) -> Instance:
    """Return an instrument's instance with its columns about `values`, on the reading of `believed`; loads are linear as they are."""
    if not isinstance(instance.effect, InstrumentEffect) or instance.effect.own_in_every_recording:
        return instance
    return replace(instance, effect=instance.with_values(values.to(torch.float64)), believed=believed, start=False)
