"""From a finished race to findings: rivals, classes, confidence, parameters with intervals.

A rival that takes a finding's place and predicts left-out recordings no worse (sign-flip p > 0.05), or hardly worse with a torque that is
much the finding's own (cosine above 0.97), belongs to the finding's class: a law of slightly other form leaves as much, unless it has more
parameters than the finding and still predicts worse. A drift that stays where it is is none (nnhydro.diagnosis.still). Of members that are
one torque (0.98) the one with the fewest parameters names it. The family is named where the class lies in one. Confidence is the class's
weight among all rivals, softened for the correlation of residuals.
"""

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.instances import Hypothesis
from nnhydro.diagnosis.locks import SOFT, left_out_p
from nnhydro.diagnosis.race import Race, laws_of, ranked
from nnhydro.diagnosis.still import stays
from nnhydro.diagnosis.uncertainty import Fit, fitted, likeness
from nnhydro.effects.quantity import intervals

Array = NDArray[np.float64]
NEAR = 10.0  # rivals further behind than this never enter a class by their score
ALIKE, LITTLE = 0.98, 0.02  # cosine from which two effects are one torque, where the better one gains no more than this share of the whole
MUCH_ALIKE, HARDLY = 0.97, 0.05  # the same for two effects that cannot be told apart where either law may have another form
SPECIAL = 0.15  # of the whole: what the general form of a family may gain more than a law of its own family of the same torque
CLEAR, RESEMBLING = 20.0, 0.9  # how far ahead of the general form of its family an effect must be that resembles it
MOST_RIVALS = 5


@final
@dataclass(frozen=True, eq=False)
class Rival:
    """What could take a finding's place: its score behind the winner, p that the winner predicts better, likeness of their torques."""

    behind: float
    p: float
    likeness: float
    gain: float  # of the finding itself
    general: bool  # whether it is the general form of the finding's family
    candidate: Candidate
    special: bool = False  # whether the finding is the general form of its family
    wider: bool = False  # whether each of its laws has more parameters than the finding

    @property
    def in_class(self) -> bool:
        """Whether the rival cannot be told from the finding."""
        if self.general and self.likeness > RESEMBLING and self.behind < CLEAR:
            return True
        if self.likeness > MUCH_ALIKE and self.behind < max(NEAR, 0.0 if self.wider else HARDLY * self.gain):
            return True
        if self.special and self.likeness > ALIKE and self.behind < SPECIAL * self.gain:
            return True
        return self.behind < NEAR and (self.p > 0.05 or self.behind < 2.0)

    @property
    def same_torque(self) -> bool:
        """Whether the rival may stand for the finding: in its class, and its torque the finding's own."""
        return self.likeness > ALIKE and self.behind < max(NEAR, LITTLE * self.gain, CLEAR * self.general)


@final
@dataclass(frozen=True, eq=False)
class Finding:
    """One effect that was left out, with all that diagnosis.json tells about it."""

    effect: Hypothesis
    family: str | None
    members: tuple[str, ...]  # the class, itself included
    confidence: float
    statement: str
    parameters: dict[str, dict[str, Any]]
    rivals: list[dict[str, Any]]
    candidate: Candidate
    covariance: Array  # (p, p) of the effect's linear values

    @property
    def lasts(self) -> bool:
        """Whether the effect is known to act in what is recorded next."""
        return self.candidate.instance.spell is None or self.candidate.instance.spell.foreseeable

    def document(self, before: float, after: float) -> dict[str, Any]:
        """Return the finding for diagnosis.json."""
        return {"effect": self.effect.id, "family": self.family, "class": list(self.members), "joint": self.effect.joint or None,
                "confidence": self.confidence, "statement": self.statement, "parameters": self.parameters,
                "heldout": {"error_before": before, "error_after": after}, "rivals": self.rivals} | self._acts()

    def _acts(self) -> dict[str, Any]:
        spell = self.candidate.instance.spell
        return {} if spell is None else {"acts": spell.document()}


def rivals_of(race: Race, candidate: Candidate) -> list[Rival]:
    """Return what could take the candidate's place, best first."""
    now, base = race.scored(), race.total(without=[candidate])
    total, found = race.total(), []
    for gain, rival in ranked(race, race.bank.candidates, [candidate])[: MOST_RIVALS + 1]:
        if rival.key == candidate.key or stays(race, race.kept(without=[candidate]), rival):
            continue
        there, one, other = race.scored([rival], [candidate]), rival.instance.effect, candidate.instance.effect
        general, special = (a.general and one.family == other.family for a in (one, other))
        wider = min(map(parameter_count, laws_of(race, rival))) > parameter_count(candidate)
        found.append(Rival((base - gain) - total, left_out_p(there, now), likeness(race, candidate, rival), base - total, general, rival,
                           special, wider))
    return found[:MOST_RIVALS]


def _effect(fit: Fit, candidate: Candidate) -> Hypothesis:
    """The candidate's effect with its fitted values; the amplitude of one whose phase is each recording's own."""
    values, _ = fit.of(candidate)
    return candidate.instance.with_values(torch.from_numpy(values[: len(candidate.instance.effect.linear_names())].copy()))


def _parameters(fit: Fit, candidate: Candidate, effect: Hypothesis) -> tuple[dict[str, dict[str, Any]], dict[str, tuple[float, float]]]:
    values, covariance = fit.of(candidate)
    shape = tuple(candidate.instance.spans)
    p = len(values) - len(shape)

    def quantities(x: torch.Tensor) -> Any:
        changes: dict[str, Any] = {name: (float(v),) * len(getattr(effect, name)) for name, v in zip(shape, x[p:], strict=True)}
        return replace(effect.with_linear(x[: len(effect.linear_names())]), **changes).quantities()

    spans = intervals(quantities, torch.from_numpy(values.copy()), torch.from_numpy(covariance.copy()))
    return {name: {"value": q.value, "unit": q.unit, "ci95": list(spans[name])} for name, q in effect.quantities().items()}, spans


def _told(statement: str, candidate: Candidate) -> str:
    spell = candidate.instance.spell
    return statement if spell is None else f"{statement} It acts {spell.sentence()} only."


def _finding(race: Race, fit: Fit, candidate: Candidate) -> Finding:
    effect = _effect(fit, candidate)
    parameters, spans = _parameters(fit, candidate, effect)
    linear = len(effect.linear_names())
    rivals = rivals_of(race, candidate)
    weights = np.exp(-np.maximum([0.0, *(r.behind for r in rivals)], 0.0) / SOFT)
    inside = [r.candidate for r in rivals if r.in_class]
    members = {c.key[0] for c in (candidate, *inside)}
    families = {c.instance.effect.family for c in (candidate, *inside)}
    support = [{"effect": r.candidate.key[0], "joint": r.candidate.key[1] or None, "support": float(w / weights.sum()),
                "behind": round(r.behind, 2), "likeness": round(r.likeness, 3)} for r, w in zip(rivals, weights[1:], strict=True)]
    same = sum(w for r, w in zip(rivals, weights[1:], strict=True) if r.candidate.key[0] in members)
    statement = _told(effect.statement(spans), candidate)
    return Finding(effect, families.pop() if len(families) == 1 else None, (effect.id, *sorted(members - {effect.id})),
                   float(min((weights[0] + same) / weights.sum(), 0.99)), statement, parameters, support, candidate,
                   fit.of(candidate)[1][:linear, :linear])


def parameter_count(candidate: Candidate) -> int:
    """Return the number of its parameters."""
    return len(candidate.columns) + len(candidate.own) + len(candidate.instance.spans)


def simplest(race: Race) -> list[Candidate]:
    """Return the chosen candidates, each replaced by a rival with fewer parameters and the same torque where there is one."""
    for place, chosen in enumerate(race.chosen):
        alike = [r.candidate for r in rivals_of(race, chosen) if r.same_torque]
        race.chosen[place] = min([chosen, *alike], key=parameter_count)
    return race.chosen


def findings(race: Race) -> list[Finding]:
    """Return one finding for each chosen candidate of the race, in the order in which they were found."""
    fit = fitted(race)
    return [_finding(race, fit, candidate) for candidate in race.chosen]
