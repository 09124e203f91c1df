"""What of a law is asked only once its effect is found: a contact that bends before it slips is dry friction all the same.

Tried among all hypotheses such values would follow whatever a real arm leaves near reversals and pass for noise that is known, or make room
for names that are none. Once the effect stands, the value with the least left-out score is taken where it gains `LEAST`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, final

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.instances import Instance, beside, finer
from nnhydro.diagnosis.race import UNPHYSICAL, Race, race_of
from nnhydro.diagnosis.table import Table
from nnhydro.models.strip_theory import StripTheory

LEAST = 15.0  # score that a detail must gain
ROUNDS = 3  # of finer values


def with_detail(instance: Instance, name: str, value: float) -> Instance:
    """Return `instance` with the parameter `name` at `value`, between the neighbouring values on its card; nothing else is refined."""
    changes: dict[str, Any] = {name: (value,)}
    span = beside((0.0, *instance.effect.details()[name]), value)
    return replace(instance, effect=replace(instance.effect, **changes), spans={name: span})


@final
@dataclass(frozen=True, eq=False)
class Asked:
    """On what details are asked: the recordings, what unsettled instruments read, the noise seen in repeats (joints,) N m.

    The noise is estimated anew for every race: what a bent contact leaves of a step passed for noise before.
    """

    table: Table
    believed: StripTheory
    repeats: tuple[float, ...] | None

    def race(self, instances: Sequence[Instance], chosen: int) -> Race:
        """Return the race over `instances` with the first ones chosen."""
        made = race_of(self.table, instances, self.believed, self.repeats)
        made.chosen = list(made.bank.candidates[:chosen])
        return made


def _best(asked: Asked, race: Race, chosen: Candidate, tried: Sequence[Instance]) -> tuple[float, Instance]:
    """The largest gain of one of `tried` in the place of `chosen`, and which; no gain where the set as it is has no physical values."""
    others = [c.instance for c in race.chosen if c is not chosen]
    there = asked.race([*others, chosen.instance, *tried], len(others))
    before, *after = there.bank.candidates[len(others):]
    now = there.total([before])
    gain, best = max(((now - there.total([c]), c.instance) for c in after), key=lambda one: one[0])
    return (gain if now < UNPHYSICAL else 0.0), best


def _rivals(race: Race, chosen: Candidate, found: Instance, name: str) -> list[Instance]:
    """The other laws of the joint that have the detail, with its value: a class is decided among equals."""
    value: dict[str, Any] = {name: getattr(found.effect, name)}
    return [replace(c.instance, effect=replace(c.instance.effect, **value), spans={**c.instance.spans, name: found.spans[name]})
            for c in race.bank.candidates
            if name in c.instance.effect.details() and c.key[1] == chosen.key[1] and c.key[0] != chosen.key[0]]


def _detailed(asked: Asked, race: Race, chosen: Candidate, name: str) -> Race:
    """The race with the detail `name` of `chosen`, and of the rivals that have it, too, where it gains enough."""
    tried: Sequence[Instance] = [with_detail(chosen.instance, name, value) for value in chosen.instance.effect.details()[name]]
    for _ in range(ROUNDS + 1):
        gain, found = _best(asked, race, chosen, tried)
        tried = finer(found)
    if gain < LEAST:
        return race
    found = replace(found, spans={**chosen.instance.spans, name: found.spans[name]})
    kept = [found if c is chosen else c.instance for c in race.chosen]
    near = finer(found)[1:]  # what intervals are told from: each parameter a little off
    rest = [c.instance for c in race.bank.candidates if c not in race.chosen]
    made = asked.race([*kept, *near, *_rivals(race, chosen, found, name), *rest], len(kept))
    log = [*race.log, f"{chosen.key[0]} joint {chosen.key[1]}: {gain:.1f} by {name} = {getattr(found.effect, name)[0]:.3g}"]
    return replace(made, log=log, first_gain=race.first_gain)


def detailed(asked: Asked, race: Race) -> Race:
    """Return the race with the details of what is chosen, one after the other."""
    for place in range(len(race.chosen)):
        for name in race.chosen[place].instance.effect.details():
            race = _detailed(asked, race, race.chosen[place], name)
    return race
