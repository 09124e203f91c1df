"""Confidence by rehearsal: draw this campaign again with its findings, and with their rivals, and count what would be named.

    y = A m + e,  e ~ N(0, I)  on whitened rows, m the values of a scenario        confidence <= (hits + 1/2) / (hits + misnamed + 1)

hits: draws of the finding that name it; misnamed: as many draws of a rival, counted if they name the finding nevertheless. A draw includes
the unexplained residual. It is named by the score of the claimed set, of the set without the finding, and with each rival in its place.
Causes outside the catalogue are not drawn: the confidence of the posterior, which knows the unexplained residual, stays the upper bound.
Source: simulation-based calibration in the manner of Talts et al. (2018), arXiv:1804.06788; the ratio (Jeffreys' prior) is ours.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from nnhydro.diagnosis.calibration.injection import predict_whitened, with_torque
from nnhydro.diagnosis.constants import LEAST_GAIN
from nnhydro.diagnosis.decision.alternative_laws import EQUIVALENT_COSINE
from nnhydro.diagnosis.findings.equivalence import rivals_of
from nnhydro.diagnosis.findings.finding import Finding
from nnhydro.diagnosis.problem.hypothesis import Key
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search

RIVALS = 2  # rivals of each finding that are injected in its place
Rivals = dict[int, tuple[int, ...]]  # of each claimed hypothesis


@final
@dataclass(frozen=True, eq=False)
class Scenario:
    """What is drawn: a fitted set; `instead` is the claimed hypothesis that a rival replaces, None for the claims."""

    planted: ScoredSet
    instead: int | None
    rival: int | None


def scenarios(search: Search, claimed: ScoredSet, rivals: Rivals) -> list[Scenario]:
    """Return what is rehearsed: the claims, and the claims with one of them replaced by its nearest rivals of another torque."""
    made = [Scenario(claimed, None, None)] if claimed.chosen else []
    for k, others in rivals.items():
        made += [Scenario(search.score((*claimed.without(k), r)), k, r) for r in others[:RIVALS]]
    return made


def _true_members(search: Search, claimed: ScoredSet, rivals: Rivals) -> list[int]:
    """The hypotheses that stand in the drawn campaign of `search`: each claim, a rival of it, or nothing."""
    named = []
    for k, others in rivals.items():
        rest = search.score(claimed.without(k))
        sets = [(search.score((*rest.chosen, member)), member) for member in (k, *others)]
        taking = [(s, member) for s, member in sets if search.admits(rest, s) and search.gain(rest, s) > LEAST_GAIN]
        if taking:
            named.append(max(taking, key=lambda pair: pair[0].score)[1])
    return named


def rehearse(search: Search, claimed: ScoredSet, draws: int, seed: int,
             progress: Callable[[str], None] = lambda line: None) -> dict[str, Any]:
    """Return what was injected and what was named, `draws` times per scenario, as diagnosis.json holds it."""
    others = {k: rivals_of(search, claimed, k)[1] for k in claimed.chosen}
    rivals = {k: tuple(rival.number for rival in found) for k, found in others.items()}
    unlike = {k: tuple(rival.number for rival in found if rival.cosine <= EQUIVALENT_COSINE) for k, found in others.items()}
    rows, rehearsed = [], scenarios(search, claimed, unlike)
    for number, scenario in enumerate(rehearsed):
        count: dict[str, int] = {}
        mean = predict_whitened(search.view, scenario.planted, claimed)
        for draw in range(draws):
            progress(f"rehearsal {number * draws + draw + 1} of {len(rehearsed) * draws}")
            y = mean + np.random.default_rng([seed, number, draw]).standard_normal(mean.shape)
            drawn = Search(with_torque(search.view, y), search.start)
            for k in _true_members(drawn, claimed, rivals):
                count[label(search.key(k))] = count.get(label(search.key(k)), 0) + 1
        keys = [k for k in claimed.chosen if k != scenario.instead] + ([] if scenario.rival is None else [scenario.rival])
        rows.append({"planted": [label(search.key(k)) for k in keys],
                     "instead_of": None if scenario.instead is None else label(search.key(scenario.instead)),
                     "named": dict(sorted(count.items(), key=lambda pair: -pair[1]))})
    return {"draws": draws, "worlds": rows}


def label(key: Key) -> str:
    """Return an effect and its joint in words."""
    return f"{key[0]} joint {key[1]}" if key[1] else key[0]


def _of(finding: Finding, counts: dict[str, int]) -> int:
    """How often a draw named a member of the finding's class."""
    joints = {label((name, joint)) for name in finding.equivalence_set for joint in (finding.law.joint, 0)}
    return sum(n for name, n in counts.items() if name in joints)


def limit_confidence(finding: Finding, rehearsal: dict[str, Any]) -> Finding:
    """Return the finding with the confidence that the rehearsal leaves it."""
    mine = label((finding.effect, finding.law.joint))
    hits = sum(_of(finding, scenario["named"]) for scenario in rehearsal["worlds"] if scenario["instead_of"] is None)
    others = [scenario for scenario in rehearsal["worlds"]
              if scenario["instead_of"] == mine and scenario["planted"][-1].partition(" ")[0] not in finding.equivalence_set]
    misnamed = max((_of(finding, scenario["named"]) for scenario in others), default=0)
    return replace(finding, confidence=float(min((hits + 0.5) / (hits + misnamed + 1.0), finding.confidence)))
