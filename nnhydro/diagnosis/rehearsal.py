"""Confidence by rehearsal: plant what was found, and what could be meant instead, on the campaign's own motions; see what would be named.

    confidence = (hits + 1/2) / (hits + misnamed + 1)

hits: rehearsals of the finding that name it; misnamed: rehearsals of a rival in its place that name the finding all the same. Both are
as many. A rehearsal is the whole naming again, on torques of the calibrated baseline plus the fitted effects plus the campaign's noise.
Source: simulation-based calibration in the manner of Talts et al. (2018), arXiv:1804.06788; the ratio (Jeffreys' prior) is ours.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.case import Case
from nnhydro.diagnosis.instances import Instance, Key
from nnhydro.diagnosis.naming import named
from nnhydro.diagnosis.planting import planted
from nnhydro.diagnosis.race import Race
from nnhydro.diagnosis.verdict import Finding, rivals_of

Array = NDArray[np.float64]
RIVALS = 2  # of each finding that are rehearsed in its place


@final
@dataclass(frozen=True, eq=False)
class World:
    """What is planted: effects with their linear values; `instead` is the finding that a rival stands in for, None for the findings."""

    effects: tuple[tuple[Instance, Array], ...]
    instead: Key | None

    @property
    def keys(self) -> tuple[Key, ...]:
        """What a perfect diagnosis would name."""
        return tuple(instance.key for instance, _ in self.effects)


def _world(race: Race, kept: Sequence[Candidate], instead: Key | None) -> World:
    values = race.values([c for c in kept if not c.own])[1]
    made = []
    for c in kept:
        sizes = np.array([values[k] for k in c.columns]) if not c.own else np.full(len(c.own), _own_size(race, c))
        made.append((c.instance, sizes))
    return World(tuple(made), instead)


def _own_size(race: Race, candidate: Candidate) -> float:
    """The size of each value that is a recording's own, so that the planted torque has the energy that the candidate takes away."""
    own = race.bench.p + np.array(candidate.own)
    gain = float(sum(np.diag(race.bench.total)[own]))
    taken = (race.scored(without=[candidate]).energy - race.scored().energy).sum() if candidate in race.chosen else 0.0
    return float(np.sqrt(max(taken, 0.0) / max(gain, 1e-300)))


def worlds(race: Race) -> list[World]:
    """Return what is rehearsed: the findings, and each of them replaced by its nearest rivals that have no values of a recording's own."""
    made = [_world(race, race.chosen, None)] if race.chosen else []
    for chosen in race.chosen:
        others = [c for c in race.chosen if c is not chosen]
        rivals = [r.candidate for r in rivals_of(race, chosen) if not r.candidate.own and r.candidate.key[0] != chosen.key[0]][:RIVALS]
        made += [_world(race, [*others, rival], chosen.key) for rival in rivals]
    return made


def rehearse(case: Case, race: Race, draws: int, seed: int, without: Sequence[str] = (),
             progress: Callable[[str], None] = lambda line: None) -> dict[str, Any]:
    """Return what was planted and what was named, `draws` times a world, as diagnosis.json holds it."""
    told, rehearsed = [], worlds(race)
    for number, world in enumerate(rehearsed):
        count: dict[str, int] = {}
        for draw in range(draws):
            progress(f"rehearsal {number * draws + draw + 1} of {len(rehearsed) * draws}")
            made = planted(case, world.effects, race.noise, seed + 1000 * number + draw)
            for f in named(made, None, seed + draw, without).findings:
                for name in f.members:
                    key = label((name, f.effect.joint))
                    count[key] = count.get(key, 0) + 1
        told.append({"planted": [label(key) for key in world.keys], "instead_of": None if world.instead is None else label(world.instead),
                     "named": dict(sorted(count.items(), key=lambda pair: -pair[1]))})
    return {"draws": draws, "worlds": told}


def label(key: Key) -> str:
    """Return an effect and its joint in words."""
    return f"{key[0]} joint {key[1]}" if key[1] else key[0]


def confident(finding: Finding, rehearsal: dict[str, Any]) -> Finding:
    """Return the finding with the confidence that the rehearsal gives it."""
    mine = label((finding.effect.id, finding.effect.joint))
    said = [(world["instead_of"], world["planted"][-1].partition(" ")[0], world["named"].get(mine, 0)) for world in rehearsal["worlds"]]
    hits = sum(count for instead, _, count in said if instead is None)
    misnamed = max((count for instead, rival, count in said if instead == mine and rival not in finding.members), default=0)
    return replace(finding, confidence=float(min((hits + 0.5) / (hits + misnamed + 1.0), 0.99)))
