"""A finding: one effect that was left out, its values with intervals, the effects that cannot be told from it, and its sentence.

Values are those of the fit without the unknown: the unknown is what is orthogonal to the named effects and must not take from their size.
Intervals hold the posterior's spread, the scatter of the recordings, and the bend of the score over nonlinear values.
Source: orthogonal discrepancy, Plumlee (2017), J. Am. Stat. Assoc. 112.
"""

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import NEAR
from nnhydro.diagnosis.findings.equivalence import Alternative, alternatives
from nnhydro.diagnosis.problem.activity import ActivityWindow
from nnhydro.diagnosis.problem.hypothesis import AnyEffect, Hypothesis
from nnhydro.diagnosis.search.stepwise import Scored, Search
from nnhydro.diagnosis.search.values import Values, values_of
from nnhydro.effects.quantity import intervals

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Finding:
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

    def document(self, before: float, after: float) -> dict[str, Any]:
        """Return the finding for diagnosis.json."""
        acts = {} if self.activity is None else {"acts": self.activity.document()}
        return {"effect": self.effect.id, "family": self.family, "class": list(self.members), "level": self.level,
                "joint": self.effect.joint or None, "confidence": self.confidence, "statement": self.statement,
                "parameters": self.parameters, "heldout": {"error_before": before, "error_after": after}, "rivals": self.rivals} | acts


def _shape_variance(search: Search, found: Scored, h: Hypothesis, k: int) -> dict[str, float]:
    """The variance of each nonlinear value from the bend of the score between its neighbours in the library."""
    made = {}
    for name, (low, high) in h.spans.items():
        half = (high - low) / 2
        if not half > 0:
            continue
        value = getattr(h.effect, name)[0]
        near = [(getattr(o.effect, name)[0], i) for i, o in enumerate(search.view.library.hypotheses)
                if o.key == h.key and o.width == h.width and i != k and getattr(o.effect, name)
                and all(getattr(o.effect, shape) == getattr(h.effect, shape) for shape in h.spans if shape != name)]
        drops = [((v - value) ** 2, found.score - search.score((*(x for x in found.chosen if x != k), i)).score)
                 for v, i in sorted(near, key=lambda pair: abs(pair[0] - value))[:2]]
        bends = [d2 / (2 * max(drop, 0.05)) for d2, drop in drops if d2 > 0]
        made[name] = min(bends) if bends else half**2 / 3
    return made


def _parameters(effect: AnyEffect, values: Values,
                shapes: dict[str, float]) -> tuple[dict[str, dict[str, Any]], dict[str, tuple[float, float]]]:
    names, p = tuple(shapes), len(values.mean)
    mean = np.concatenate([values.mean, [getattr(effect, name)[0] for name in names]])
    covariance = np.zeros((p + len(names), p + len(names)))
    covariance[:p, :p] = values.covariance
    covariance[np.arange(p, p + len(names)), np.arange(p, p + len(names))] = list(shapes.values())
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


def finding_of(search: Search, found: Scored, k: int) -> Finding:
    """Return the finding of member `k` of the claimed set."""
    h = search.view.library.hypotheses[k]
    values = values_of(search, found, k)
    effect = h.with_values(torch.from_numpy(values.mean.copy()))
    linear = len(effect.linear_names())
    offset = float(values.mean[linear]) if len(values.mean) > linear else 0.0
    values = Values(values.mean[:linear], values.covariance[:linear, :linear])
    parameters, spans = _parameters(effect, values, _shape_variance(search, found, h, k))
    confidence, others = alternatives(search, found, k)
    inside = [a for a in others if a.equivalent]
    members = dict.fromkeys([effect.id, *(search.key(a.number)[0] for a in inside)])
    families = {effect.family, *(search.view.library.hypotheses[a.number].effect.family for a in inside)}
    statement = effect.statement(spans)
    statement = statement if h.activity is None else f"{statement} It acts {h.activity.sentence()} only."
    own = search.view.library.design.problem.arm.text  # a linear axis reads m and N
    parameters = {name: parameter | {"unit": own(parameter["unit"])} for name, parameter in parameters.items()}
    rivals = [_rival(search, a) for a in others if a.deficit < 5 * NEAR][:5]
    return Finding(effect, families.pop() if len(families) == 1 else None, tuple(members), confidence, own(statement), parameters,
                   rivals, values.covariance, k, h.activity, offset)
