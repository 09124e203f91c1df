"""The search in rounds: select over the grids, refine what is chosen and its nearest rivals, select again, until nothing changes.

Refining means finer values of nonlinear parameters, and columns of instrument effects about their fitted values on the reading of the model
as it then is. Rivals are refined like the chosen: a stale start would decide between them otherwise.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import final

import torch

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.case import Case
from nnhydro.diagnosis.instances import Instance, Key, finer, settled
from nnhydro.diagnosis.locks import MISMATCH_TESTS, P_BLOCK, TRIED, Extremes, gain_p, known_p
from nnhydro.diagnosis.race import Race, gains, race_of, ranked
from nnhydro.diagnosis.scout import MANY, scouted
from nnhydro.diagnosis.spells import in_the_same_part, spelled
from nnhydro.diagnosis.table import Table
from nnhydro.diagnosis.tournament import run, run_again
from nnhydro.effects.effect import LoadEffect
from nnhydro.identification.identify import with_parameters
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads

ROUNDS = 5
ROUNDS_IN_PARTS = 2
RIVALS = 5  # of each chosen effect, and of the first, that are refined with it
SETTLED = 1.0  # change of the score between rounds that counts as none,
STEADY = 0.002  # or this share of the first gain


@final
@dataclass(frozen=True, eq=False)
class Found:
    """The finished race, what the instruments read, the p of "nothing is missing", and the log."""

    race: Race
    table: Table
    believed: StripTheory
    p_value: float


def with_loads(case: Case, race: Race, kept: Sequence[Candidate]) -> StripTheory:
    """Return the baseline refitted beside `kept`, with the loads among them that always act as terms."""
    z, by_column = race.values(kept)
    loads = with_parameters(case.model.loads, case.before.mean + case.before.F @ z)
    for i, candidate in enumerate(kept):
        effect = candidate.instance.with_values(torch.tensor([by_column.get(k, 0.0) for k in candidate.columns], dtype=torch.float64)) \
            if not candidate.own else None
        if isinstance(effect, LoadEffect) and candidate.instance.spell is None:
            loads = Loads({**loads.terms, f"found_{i}": effect})
    return replace(case.model, loads=loads)


def _targets(race: Race) -> dict[Key, tuple[Candidate, list[Candidate]]]:
    """What is refined: each chosen candidate and its rivals, and the best alone; with the others that stand beside it."""
    bank = race.bank.candidates
    targets: dict[Key, tuple[Candidate, list[Candidate]]] = {}
    for chosen in race.chosen:
        others = [c for c in race.chosen if c is not chosen]
        for _, rival in [(0.0, chosen), *ranked(race, bank, [chosen])[:RIVALS]]:
            targets.setdefault(rival.key, (rival, others))
    empty = replace(race, chosen=[])
    for gain, alone in ranked(empty, bank)[:RIVALS]:
        if gain > 0:
            targets.setdefault(alone.key, (alone, []))
    return targets


def _refined(case: Case, race: Race) -> tuple[Instance, ...]:
    """The instances of the next round: refined ones of the targets, the others, and other laws of the same effects, as they are."""
    made: list[Instance] = []
    targets = _targets(race)
    for target, others in targets.values():
        kept = [*others, target]
        values = torch.tensor([race.values(kept)[1].get(k, 0.0) for k in target.columns], dtype=torch.float64)
        believed = with_loads(case, race, kept)  # the reading that the instrument changes: fitted with it, not in its stead
        made += [settled(one, values, believed) for one in finer(target.instance)]
    laws = {key: target.instance.effect.linear_names() for key, (target, _) in targets.items()}
    same = [c.instance for c in race.bank.candidates if c.grid <= MANY and laws.get(c.key) != c.instance.effect.linear_names()]
    return (*made, *same)


def mismatch(table: Table, known: Sequence[Instance], repeats: tuple[float, ...] | None, seed: int) -> tuple[float, Race]:
    """Return the p of "nothing is missing" over all of `known`, and the race over those that go on, with nothing chosen.

    Three tests: random signs of blocks, the left-out likelihood of the best candidate, and what is known of the masses.
    """
    believed = table.case.model
    few, many = [i for i in known if i.grid <= MANY], [i for i in known if i.grid > MANY]
    race = race_of(table, few, believed, repeats)
    extremes = Extremes().beside(race, seed)

    def count(tried: Race) -> None:
        nonlocal extremes
        extremes = extremes.beside(tried, seed)

    best = scouted(table, many, race, believed, count)
    race = race_of(table, [*few, *best], believed, repeats)
    p_likelihood = gain_p(max((gain for gain, _ in gains(race, race.bank.candidates)), default=0.0), TRIED)
    return min(1.0, MISMATCH_TESTS * min(extremes.p_value, p_likelihood, known_p(race, race.scored()))), race


def _in_parts(found: Found, repeats: tuple[float, ...] | None, seed: int) -> Race | None:
    """The race again with what may act in a part of the campaign, refined about its values there; None where nothing may."""
    table, believed = found.table, found.believed
    spells = spelled(found.race, table, believed)
    if not spells:
        return None
    race = run(race_of(table, [*spells, *(c.instance for c in found.race.bank.candidates)], believed, repeats), seed)
    if any(c.instance.spell is not None for c in race.chosen):
        for _ in range(ROUNDS_IN_PARTS):
            rivals = in_the_same_part(race, table, believed, RIVALS)
            again = run_again(race_of(table, [*rivals, *_refined(table.case, race)], believed, repeats), race, seed)
            again.log = [*race.log, *again.log]
            race = again
    race.log = [*found.race.log, *race.log]
    return race


def in_a_part(nothing: Found, repeats: tuple[float, ...] | None, seed: int) -> Found:
    """Return what acts in a part of the campaign only, where no block test sees anything: its left-out likelihood must testify alone.

    The p of what is found is a bound. `nothing` is the search so far, `repeats` (joints,) N m the noise seen in repeats.
    """
    race = _in_parts(nothing, repeats, seed)
    return nothing if race is None or not race.chosen else replace(nothing, race=race, p_value=P_BLOCK)


def search(case: Case, known: Sequence[Instance], repeats: tuple[float, ...] | None, seed: int,
           progress: Callable[[str], None] = lambda line: None) -> Found:
    """Return what the search settles on."""
    table, believed = Table(case), case.model
    many = [i for i in known if i.grid > MANY]
    p_value, race = mismatch(table, known, repeats, seed)
    if p_value > P_BLOCK:
        return in_a_part(Found(race, table, believed, p_value), repeats, seed)
    race, log = run(race, seed), []
    for number in range(ROUNDS):
        progress(f"round {number + 1}: {', '.join(c.key[0] for c in race.chosen) or 'nothing yet'}")
        log += [f"round {number + 1}", *race.log]
        score, keys = race.total(), {c.key for c in race.chosen}
        loads = with_loads(case, race, race.chosen)
        believed = loads if keys else believed
        instances = _refined(case, race)
        refined = {one.key for one in instances}
        best = scouted(table, [one for one in many if one.key not in refined], race, believed)
        race = run_again(race_of(table, [*instances, *best], believed, repeats), race, seed)
        table.forget([*many, *instances, *best], believed)
        if {c.key for c in race.chosen} == keys and abs(race.total() - score) < max(SETTLED, STEADY * race.first_gain) and number:
            break
    log += ["last round", *race.log]
    race.log = log
    found = Found(race, table, believed, p_value)
    return replace(found, race=_in_parts(found, repeats, seed) or race)
