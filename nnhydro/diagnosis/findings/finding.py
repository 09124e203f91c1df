"""A finding: one effect that the baseline omits, its parameters with intervals, its alternatives and rivals, and its sentence.

Values are those of the fit without the unknown: the unknown is what is orthogonal to the named effects and must not take from their size.
Intervals hold the posterior's spread, the scatter of the recordings (search.values), and how nonlinear values are known beside the linear
ones (search.tangents).

Source: orthogonal discrepancy, Plumlee (2017), J. Am. Stat. Assoc. 112.
"""

from dataclasses import dataclass, field, replace
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import LEAST_GAIN
from nnhydro.diagnosis.findings.baseline_spread import spread_by_baseline
from nnhydro.diagnosis.findings.equivalence import Rival, rivals_of
from nnhydro.diagnosis.findings.sheets import parameters_sheet, rivals_sheet
from nnhydro.diagnosis.problem.activity import ActivityWindow
from nnhydro.diagnosis.problem.hypothesis import AnyEffect
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.tangents import Tangents, tangents_of
from nnhydro.diagnosis.search.values import intervals_of_scale, quantity_intervals, values_of
from nnhydro.effects.catalogue import catalogue
from nnhydro.effects.effect import LoadEffect
from nnhydro.sheet import ResultView, Sheet

Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class Parameter:
    """A number of a finding in its unit, with its 95 % interval."""

    value: float
    unit: str
    ci95: tuple[float, float]
    # where each recording has a value of its own: `value` is their mean, `ci95` their range
    by_recording: dict[str, float] | None = field(default=None, repr=False)

    def document(self) -> dict[str, Any]:
        """Return the parameter for diagnosis.json."""
        spread = {} if self.by_recording is None else {"by_recording": self.by_recording, "note": "mean and range over recordings"}
        return {"value": self.value, "unit": self.unit, "ci95": list(self.ci95)} | spread


@final
@dataclass(frozen=True, eq=False, repr=False)
class Finding(ResultView):
    """One effect that the baseline omits; its data frame has one row per parameter."""

    law: AnyEffect
    family: str | None  # None where the alternatives span families
    equivalence_set: tuple[str, ...]  # effects that these recordings cannot distinguish, the finding's own first
    confidence: float
    statement: str
    parameters: dict[str, Parameter]
    rivals: list[dict[str, Any]]
    covariance: Array  # (p, p) of the effect's linear values
    number: int  # of its hypothesis in the library
    activity: ActivityWindow | None = None
    offset: float = 0.0  # N m, the constant of an effect that has one of its own
    error_without: float = field(default=np.nan, kw_only=True)  # on recordings held out of the fit
    error_with: float = field(default=np.nan, kw_only=True)

    @property
    def effect(self) -> str:
        """The id of the effect in the catalogue."""
        return self.law.id

    @property
    def joint(self) -> int | None:
        """The joint (or link) from 1; None: the whole arm."""
        return self.law.joint or None

    @property
    def alternatives(self) -> tuple[str, ...]:
        """The effects that these recordings cannot distinguish from it."""
        return self.equivalence_set[1:]

    def verdict(self) -> str:
        """Return the finding as a sentence with numbers."""
        return self.statement

    def sheets(self) -> tuple[Sheet, ...]:
        """Return the parameters with their intervals, and the rivals."""
        document = self.document()
        return parameters_sheet([document]), rivals_sheet(document)

    @property
    def persists(self) -> bool:
        """Whether the effect is known to act in what is recorded next."""
        return self.activity is None or self.activity.persists

    @property
    def predicted(self) -> bool:
        """Whether a model with the effect predicts recordings that no fit has seen better, as far as its torque can be predicted."""
        return not (self.law.per_recording or (self.law.predictable_share < 1 and self.error_without <= self.error_with))

    @property
    def level(self) -> str:
        """Whether the leaf is certain, or the family alone."""
        return "leaf" if len(self.equivalence_set) == 1 else "family"

    def equivalents(self) -> str:
        """Return the other effects that may be the cause, as a sentence; empty where there are none."""
        names = [catalogue()[id_].name for id_ in self.alternatives]
        if not names:
            return ""
        listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
        return f" These recordings cannot distinguish this effect from {listed}."

    def document(self) -> dict[str, Any]:
        """Return the finding for diagnosis.json."""
        acts = {} if self.activity is None else {"acts": self.activity.document()}
        return {"effect": self.effect, "family": self.family, "class": list(self.equivalence_set), "level": self.level,
                "joint": self.joint, "confidence": self.confidence, "statement": self.statement,
                "parameters": {name: parameter.document() for name, parameter in self.parameters.items()},
                "heldout": {"error_before": self.error_without, "error_after": self.error_with}, "rivals": self.rivals} | acts


def _rival(search: Search, rival: Rival) -> dict[str, Any]:
    effect, joint = search.key(rival.number)
    return {"effect": effect, "joint": joint or None, "support": float(rival.weight), "behind": round(rival.deficit, 2),
            "likeness": round(rival.cosine, 3)}


def findings_of(search: Search, found: ScoredSet) -> list[Finding]:
    """Return the finding of every member of the claimed set `found`, in its order."""
    tangents = tangents_of(search, found)
    return [_finding(search, found, k, tangents) for k in found.chosen]


def _finding(search: Search, found: ScoredSet, k: int, tangents: Tangents | None) -> Finding:
    """Return the finding of member `k`; along `tangents`, nonlinear values change the torque of the set."""
    h = search.view.library.hypotheses[k]
    values = values_of(search, found, k, tangents)
    scale_spread = search.view.library.design.scale_spread if isinstance(h.effect, LoadEffect) else 0.0
    values.covariance[: h.width, : h.width] += spread_by_baseline(search, found, k)
    effect = h.with_values(torch.from_numpy(values.mean.copy()))
    linear = len(effect.linear_names())
    offset = float(values.mean[linear]) if h.width > linear else 0.0
    shown = [*range(linear), *range(h.width, len(values.covariance))]
    values = replace(values, mean=values.mean[:linear], covariance=values.covariance[np.ix_(shown, shown)])
    spans = intervals_of_scale(effect, quantity_intervals(effect, values), scale_spread)
    values = values.with_scale_known_to(scale_spread)
    text = search.view.library.design.problem.arm.text  # a linear axis reads m and N
    parameters = {name: Parameter(quantity.value, quantity.unit if name == "direction" else text(quantity.unit), spans[name])
                  for name, quantity in effect.quantities().items() if name in spans}
    confidence, others = rivals_of(search, found, k)
    inside = [rival for rival in others if rival.equivalent]
    equivalence_set = dict.fromkeys([effect.id, *(search.key(rival.number)[0] for rival in inside)])
    families = {effect.family, *(search.view.library.hypotheses[rival.number].effect.family for rival in inside)}
    lines = {search.view.library.design.problem.names[g]: f for g, f in h.lines.items()}
    if lines:
        low, high = min(lines.values()), max(lines.values())
        parameters["frequency"] = replace(parameters["frequency"], ci95=(low, high), by_recording=lines)
    statement = effect.statement(spans, {"frequency": f"{low:.3g} to {high:.3g} Hz, another in each recording," } if lines else {})
    statement = statement if h.activity is None else f"{statement} It acts only {h.activity.sentence()}."
    rivals = [_rival(search, rival) for rival in others if rival.deficit < 5 * LEAST_GAIN][:5]
    return Finding(effect, families.pop() if len(families) == 1 else None, tuple(equivalence_set), confidence, text(statement), parameters,
                       rivals, values.covariance[:linear, :linear], k, h.activity, offset)
