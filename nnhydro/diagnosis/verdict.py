"""From a finished race to findings: rivals, classes, confidence, parameters with intervals.

A rival that takes a finding's place and predicts left-out recordings no worse (Wilcoxon p > 0.05) belongs to the finding's class. The
leaf is named where it stands alone; the family where the class lies in one; else none. Confidence is the winner's weight among its
rivals, softened for the correlation of residuals.
"""

from dataclasses import dataclass
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Bank, Hypothesis
from nnhydro.diagnosis.tournament import Candidate, Race, left_out_p, ranked
from nnhydro.effects.quantity import intervals

Array = NDArray[np.float64]
SOFT = 6.0  # score difference that counts as one: left-out scores of autocorrelated rows overstate the evidence
NEAR = 10.0  # rivals further behind than this never enter a class
MOST_RIVALS = 5


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

    def document(self, before: float, after: float) -> dict[str, Any]:
        """Return the finding for diagnosis.json."""
        return {"effect": self.effect.id, "family": self.family, "class": list(self.members), "joint": self.effect.joint or None,
                "confidence": self.confidence, "statement": self.statement, "parameters": self.parameters,
                "heldout": {"error_before": before, "error_after": after}, "rivals": self.rivals}


def fitted(race: Race) -> tuple[Array, Array]:
    """Return the parameters (q,) of baseline and chosen columns, and their sandwich covariance (q, q) over blocks."""
    take = race.bench.index(race.columns())
    G = race.blocks.G.sum(axis=1)
    total = G.sum(axis=0)
    penalty = np.concatenate([race.bench.prior, np.zeros(len(take) - race.bench.p)]) + 1e-8 * np.diag(total)[take] + 1e-12
    A = total[np.ix_(take, take)] + np.diag(penalty)
    theta = np.linalg.solve(A, total[take, -1])
    scores = G[:, take, -1] - np.einsum("bqr,r->bq", G[:, take[:, None], take[None, :]], theta)
    scores = scores - scores.mean(axis=0)
    blocks = len(G)
    meat = scores.T @ scores * blocks / max(blocks - len(take), 1) + np.diag(penalty * (np.arange(len(take)) < race.bench.p))
    bread = np.linalg.inv(A)
    return theta, bread @ meat @ bread


def instance(bank: Bank, candidate: Candidate, theta: dict[int, float]) -> Hypothesis:
    """Return the candidate's effect with fitted linear values; `theta` by column of the bank."""
    effect = bank.effects[bank.candidates.index(candidate)]
    return effect.with_linear(torch.tensor([theta[k] for k in candidate.columns], dtype=torch.float64))


def _rivals(race: Race, bank: Bank, candidate: Candidate) -> list[tuple[float, float, Candidate]]:
    """(score behind the winner, p that the winner predicts better, rival) for what could take the candidate's place."""
    now = race.bench.scored(race.columns())
    base = race.total(without=[candidate])
    found = []
    for gain, rival in ranked(race, bank.candidates, [candidate])[: MOST_RIVALS + 1]:
        if rival.key == candidate.key:
            continue
        behind = (base - gain) - race.total()
        there = race.bench.scored(race.columns([rival], [candidate]))
        found.append((behind, left_out_p(there, now), rival))
    return found[:MOST_RIVALS]


def _finding(race: Race, bank: Bank, candidate: Candidate, theta: Array, covariance: Array) -> Finding:
    columns = race.columns()
    by_column = dict(zip(columns.tolist(), theta[race.bench.p:].tolist(), strict=True))
    effect = instance(bank, candidate, by_column)
    place = race.bench.p + np.searchsorted(columns, candidate.columns)
    own = torch.from_numpy(covariance[np.ix_(place, place)].copy())
    spans = intervals(lambda values: effect.with_linear(values).quantities(), effect.linear_values(), own)
    rivals = _rivals(race, bank, candidate)
    weights = np.exp(-np.maximum([0.0, *(behind for behind, _, _ in rivals)], 0.0) / SOFT)
    members = {effect.id} | {rival.effect for behind, p, rival in rivals if behind < NEAR and (p > 0.05 or behind < 2.0)}
    families = {bank.effects[bank.candidates.index(c)].family for c in (candidate, *(r for _, _, r in rivals)) if c.effect in members}
    parameters = {name: {"value": q.value, "unit": q.unit, "ci95": list(spans[name])} for name, q in effect.quantities().items()}
    support = [{"effect": rival.effect, "joint": rival.joint or None, "support": float(w / weights.sum())}
               for (_, _, rival), w in zip(rivals, weights[1:], strict=True)]
    same = sum(w for (_, _, rival), w in zip(rivals, weights[1:], strict=True) if rival.effect == effect.id)
    return Finding(effect, families.pop() if len(families) == 1 else None, (effect.id, *sorted(members - {effect.id})),
                   float(min((weights[0] + same) / weights.sum(), 0.99)), effect.statement(spans), parameters, support, candidate)


def findings(race: Race, bank: Bank) -> list[Finding]:
    """Return one finding for each chosen candidate of the race, the largest gain first."""
    theta, covariance = fitted(race)
    return [_finding(race, bank, candidate, theta, covariance) for candidate in race.chosen]
