"""A finding: one effect that was left out, its values with intervals, the effects that cannot be told from it, and its sentence.

Values are those of the fit without the unknown: the unknown is what is orthogonal to the named effects and must not take from their size.
Intervals hold the posterior's spread, the scatter of the recordings, and what nonlinear values phi are known to by the bend of the score:

    C -> [[C + G V G', G V], [V G', V]],     V = diag(d^2 / 2 (score - score_d)),  G = d beta / d phi,  d to the neighbours of phi

Source: orthogonal discrepancy, Plumlee (2017), J. Am. Stat. Assoc. 112.
"""

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import LEAST_GAIN
from nnhydro.diagnosis.findings.baseline_spread import spread_by_baseline
from nnhydro.diagnosis.findings.equivalence import Alternative, alternatives
from nnhydro.diagnosis.problem.activity import ActivityWindow
from nnhydro.diagnosis.problem.hypothesis import AnyEffect, Hypothesis
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.stepwise import ScoredSet, Search
from nnhydro.diagnosis.search.values import Values, values_of
from nnhydro.effects.catalogue import catalogue
from nnhydro.effects.quantity import intervals

Array = NDArray[np.float64]
WORSE, MOST_NEIGHBOURS = 0.5, 12  # nats by which a neighbouring value is told from the best: one standard deviation; how many are asked
FARTHER = 1.4  # times as far as the neighbour before


@final
@dataclass(frozen=True, eq=False)
class NamedEffect:
    """One effect that was left out, with all that diagnosis.json tells about it."""

    effect: AnyEffect
    family: str | None
    members: tuple[str, ...]  # effects that cannot be told apart, the finding's own first
    confidence: float
    statement: str
    parameters: dict[str, dict[str, Any]]
    rivals: list[dict[str, Any]]
    covariance: Array  # (p, p) of the effect's linear values
    number: int  # of its hypothesis in the library
    activity: ActivityWindow | None = None
    offset: float = 0.0  # N m, the constant of an effect that has one of its own

    @property
    def persists(self) -> bool:
        """Whether the effect is known to act in what is recorded next."""
        return self.activity is None or self.activity.persists

    @property
    def level(self) -> str:
        """Whether the leaf is certain, or the family alone."""
        return "leaf" if len(self.members) == 1 else "family"

    def equivalents(self) -> str:
        """Return the other effects that may be the cause, as a sentence; empty where there are none."""
        names = [catalogue()[id_].name for id_ in self.members[1:]]
        if not names:
            return ""
        listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
        return f" These recordings cannot tell it from {listed}."

    def document(self, before: float, after: float) -> dict[str, Any]:
        """Return the finding for diagnosis.json."""
        acts = {} if self.activity is None else {"acts": self.activity.document()}
        return {"effect": self.effect.id, "family": self.family, "class": list(self.members), "level": self.level,
                "joint": self.effect.joint or None, "confidence": self.confidence, "statement": self.statement,
                "parameters": self.parameters, "heldout": {"error_before": before, "error_after": after}, "rivals": self.rivals} | acts


def _shapes(search: Search, found: ScoredSet, h: Hypothesis, k: int, mean: Array) -> tuple[dict[str, float], Array]:
    """The variance of each nonlinear value from the bend of the score, and how the linear values (p,) move with it, (p, names)."""
    made, slopes = {}, []
    for name, (low, high) in h.spans.items():
        if high > low:
            made[name], slope = _bend(search, found, h, k, name, mean)
            slopes.append(slope)
    return made, np.array(slopes).reshape(-1, len(mean)).T


def _bend(search: Search, found: ScoredSet, h: Hypothesis, k: int, name: str, mean: Array) -> tuple[float, Array]:
    """Variance of `name` and slope (p,) of the linear values from the nearest neighbour that is worse by `WORSE`, else the farthest.

    Neighbours with linear values beyond their physical bounds, or linearised elsewhere, tell nothing of the bend. What is linearised about
    each recording's own values is held against its neighbours before that.
    """
    value, (low, high) = getattr(h.effect, name)[0], h.spans[name]
    laws = [(i, o) for i, o in enumerate(search.view.library.hypotheses) if o.key == h.key and o.width == h.width and not o.own
            and o.lines == h.lines and (o.working_model is None) == (h.working_model is None or bool(h.own))
            and all(getattr(o.effect, shape) == getattr(h.effect, shape) for shape in h.spans if shape != name)]
    near = [(getattr(o.effect, name)[0] - value, i) for i, o in laws if getattr(o.effect, name)]
    near = near if any(step for step, _ in near) else _of_any_shape(search, h, name, value)
    rest = tuple(x for x in found.chosen if x != k)
    centre = max((search.score((*rest, i)).score for step, i in near if step == 0), default=found.score) if h.own else found.score
    variance, slope = ((high - low) / 2) ** 2 / 3, np.zeros(len(mean))
    for step, i in _ever_farther(near)[:MOST_NEIGHBOURS]:
        there = search.score((*rest, i))
        drop, values = centre - there.score, values_of(search, there, i, best_fit(search, found))
        if values.bounded:
            continue
        variance, slope = step**2 / (2 * max(drop, WORSE)), (values.mean[: len(mean)] - mean) / step
        if drop >= WORSE:
            break
    return variance, slope


def _ever_farther(near: list[tuple[float, int]]) -> list[tuple[float, int]]:
    """Return the neighbours (step, number), nearest first, each farther by FARTHER than the one before: they crowd about the best."""
    kept: list[tuple[float, int]] = []
    for pair in sorted((pair for pair in near if pair[0] != 0), key=lambda pair: abs(pair[0])):
        if not kept or abs(pair[0]) >= FARTHER * abs(kept[-1][0]):
            kept.append(pair)
    return kept


def _of_any_shape(search: Search, h: Hypothesis, name: str, value: float) -> list[tuple[float, int]]:
    """Return the steps in `name` from `value` to all laws of `h`, whatever else they differ in: for want of any that differ in it alone."""
    return [(getattr(o.effect, name)[0] - value, i) for i, o in enumerate(search.view.library.hypotheses)
            if o.key == h.key and o.width == h.width and not o.own and o.lines == h.lines and getattr(o.effect, name)]


def _parameters(effect: AnyEffect, values: Values, shapes: dict[str, float],
                slopes: Array) -> tuple[dict[str, dict[str, Any]], dict[str, tuple[float, float]]]:
    names, p = tuple(shapes), len(values.mean)
    mean = np.concatenate([values.mean, [getattr(effect, name)[0] for name in names]])
    V = np.diag(list(shapes.values()))
    covariance = np.block([[values.covariance + slopes @ V @ slopes.T, slopes @ V], [V @ slopes.T, V]]) if names else values.covariance
    limits = {f.name: f.metadata["bounds"] for f in effect.parameters()}

    def quantities(x: torch.Tensor) -> Any:
        """Return the effect's quantities at linear values and shape parameters `x`, shapes held within their bounds."""
        changes: dict[str, Any] = {name: (float(np.clip(float(v), *limits[name])),) * len(getattr(effect, name))
                                   for name, v in zip(names, x[p:], strict=True)}
        return replace(effect.with_linear(x[:p]), **changes).quantities()

    spans = intervals(quantities, torch.from_numpy(mean.copy()), torch.from_numpy(covariance))
    told = effect.quantities()
    return {name: {"value": q.value, "unit": q.unit, "ci95": list(spans[name])} for name, q in told.items() if name in spans}, spans


def _rival(search: Search, alternative: Alternative) -> dict[str, Any]:
    effect, joint = search.key(alternative.number)
    return {"effect": effect, "joint": joint or None, "support": float(alternative.weight), "behind": round(alternative.deficit, 2),
            "likeness": round(alternative.cosine, 3)}


def finding_of(search: Search, found: ScoredSet, k: int) -> NamedEffect:
    """Return the finding of member `k` of the claimed set."""
    h = search.view.library.hypotheses[k]
    values = values_of(search, found, k)
    values = replace(values, covariance=values.covariance + spread_by_baseline(search, found, k))
    effect = h.with_values(torch.from_numpy(values.mean.copy()))
    linear = len(effect.linear_names())
    offset = float(values.mean[linear]) if len(values.mean) > linear else 0.0
    values = Values(values.mean[:linear], values.covariance[:linear, :linear])
    parameters, spans = _parameters(effect, values, *_shapes(search, found, h, k, values.mean))
    confidence, others = alternatives(search, found, k)
    inside = [a for a in others if a.equivalent]
    members = dict.fromkeys([effect.id, *(search.key(a.number)[0] for a in inside)])
    families = {effect.family, *(search.view.library.hypotheses[a.number].effect.family for a in inside)}
    lines = {search.view.library.design.problem.names[g]: f for g, f in h.lines.items()}
    if lines:
        low, high = min(lines.values()), max(lines.values())
        parameters["frequency"] |= {"ci95": [low, high], "by_recording": lines, "note": "mean and range of the recordings' own"}
    statement = effect.statement(spans, {"frequency": f"{low:.3g} to {high:.3g} Hz, another in each recording," } if lines else {})
    statement = statement if h.activity is None else f"{statement} It acts {h.activity.sentence()} only."
    own = search.view.library.design.problem.arm.text  # a linear axis reads m and N
    parameters = {name: parameter | {"unit": own(parameter["unit"])} for name, parameter in parameters.items()}
    rivals = [_rival(search, a) for a in others if a.deficit < 5 * LEAST_GAIN][:5]
    return NamedEffect(effect, families.pop() if len(families) == 1 else None, tuple(members), confidence, own(statement), parameters,
                       rivals, values.covariance, k, h.activity, offset)
