"""Effects that act in a part of the campaign: from a recording or a moment on, in some recordings, or in a sector of a joint's angles.

An effect has a spell where the left-out score gains by it as much as chance among all that was tried would not, and where what it does
outside, which could be seen there, is small beside what it does inside. `episodes` and `moments` propose; here it is decided.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf, log
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.episodes import INSIDE, OUTSIDE, Units, by_turns, in_a_row
from nnhydro.diagnosis.instances import Instance, Key
from nnhydro.diagnosis.locks import P_BLOCK, SOFT, gain_p, opens, turns
from nnhydro.diagnosis.moments import PARTS, left_by, moment, projected, sector
from nnhydro.diagnosis.race import UNPHYSICAL, Race, columns_of, laws_of, own_of, quieter, race_of, ranked
from nnhydro.diagnosis.spell import Sector, Spell
from nnhydro.diagnosis.table import Table
from nnhydro.effects.effect import LoadEffect
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
LEAST = 15.0  # score that a spell must gain
SMALL = 0.3  # what an effect does outside its spell, beside what it does inside
VISIBLE = 10.0  # energy over the noise that it would have outside, did it act there
ASKED, RIVALS = 8, 3  # candidates that were not chosen, and rivals of each chosen one, that are asked whether they act in a spell
MOST = 3  # spells that go on


@final
@dataclass(frozen=True, eq=False)
class Order:
    """The moving units in the order of the campaign: their numbers among those that hold rows, names, first and last places (n, 2)."""

    numbers: list[int]
    names: list[str]
    places: Array

    @staticmethod
    def of(table: Table) -> "Order":
        """Return the order of a table's recordings; units without a place in the campaign are left out."""
        numbers = sorted({piece.number for piece in table.pieces})
        spans: dict[int, tuple[float, float, str]] = {}
        for piece in table.pieces:
            if piece.place is not None and len(piece.place) and piece.dt:
                known = spans.get(piece.number, (inf, -inf, ""))
                spans[piece.number] = (min(known[0], float(piece.place.min())), max(known[1], float(piece.place.max())), piece.recording)
        found = sorted((low, high, name, numbers.index(number)) for number, (low, high, name) in spans.items())
        return Order([n for *_, n in found], [name for _, _, name, _ in found], np.array([[low, high] for low, high, *_ in found]))

    def __len__(self) -> int:
        return len(self.numbers)

    def spell(self, inside: Units) -> Spell:
        """Return the spell of the units in `inside`, a run from the beginning or to the end, or any others by name."""
        k = [bool(inside[number]) for number in self.numbers]
        names = frozenset(name for name, acts in zip(self.names, k, strict=True) if acts)
        turn = next((i for i in range(1, len(k)) if k[i] != k[i - 1]), len(k))
        if any(k[i] != k[i - 1] for i in range(turn + 1, len(k))):
            return Spell(inside=names, throughout=names)
        between = float(self.places[turn - 1, 1] + self.places[turn, 0]) / 2
        made = Spell(end=between, until=self.names[turn - 1]) if k[0] else Spell(begin=between, since=self.names[turn])
        return replace(made, throughout=names)


@final
@dataclass(frozen=True, eq=False)
class Judged:
    """A spell of a candidate beside `others`: score with it, what it does outside beside inside, energy it would have there, values."""

    candidate: Candidate
    others: tuple[Candidate, ...]
    spell: Spell
    options: float  # among so many it was chosen
    total: float
    outside: float
    visible: float
    better: bool
    beta: Array

    @property
    def holds(self) -> bool:
        """Whether what happens outside speaks for it."""
        return self.total < UNPHYSICAL and self.outside <= SMALL and self.visible >= VISIBLE and self.better


def judged(race: Race, table: Table, believed: StripTheory, candidate: Candidate, others: Sequence[Candidate], spell: Spell,
           options: float) -> Judged:
    """Return how `candidate` does with the spell, beside `others`, on the recordings of `race`."""
    inside = replace(candidate.instance, spell=spell)
    made = race_of(table, [inside, replace(inside, spell=spell.opposite), *(c.instance for c in others)], believed, None, race.noise)
    mine, apart, *rest = made.bank.candidates
    a, b = (made.bench.p + np.array(c.columns) for c in (mine, apart))
    theta = made.bench.scored(columns_of([mine, apart, *rest]), own_of(rest)).theta  # freely: what is outside may be of the other sign
    H = made.bench.total[np.ix_(a, a)] + made.bench.total[np.ix_(b, b)]
    w = len(a)
    sizes = [float(np.sqrt(max(v @ H @ v, 0.0))) for v in (theta[made.bench.p:][:w], theta[made.bench.p:][w:2 * w])]
    take = np.concatenate([np.arange(made.bench.p), a, *(made.bench.p + np.array(c.columns, dtype=np.int64) for c in rest), b])
    A = made.bench.total[np.ix_(take, take)] + np.diag(made.bench.penalty(take))
    left = np.linalg.inv(np.linalg.inv(A)[-w:, -w:])
    beta = theta[made.bench.p:][:w]
    gained = made.scored(rest).by_unit - made.scored([mine, *rest]).by_unit
    return Judged(candidate, tuple(others), spell, options, made.total([mine, *rest]), sizes[1] / max(sizes[0], 1e-300),
                  float(beta @ left @ beta), opens(gained), beta)


def _asked(race: Race, order: Order) -> Iterator[tuple[Candidate, list[Candidate]]]:
    """Candidates that may act in a spell, and what stands beside each: the chosen, their rivals, each alone, and those that turn."""
    alone = replace(race, chosen=[])
    for chosen in race.chosen:
        others = [c for c in race.chosen if c is not chosen]
        yield chosen, others
        yield from ((rival, others) for gain, rival in ranked(race, race.bank.candidates, [chosen])[:RIVALS] if rival.key != chosen.key)
    if race.chosen:
        yield from ((turning, list(race.chosen)) for turning in _turning(race, order.numbers))
    yield from ((best, []) for gain, best in ranked(alone, race.bank.candidates))
    yield from ((turning, []) for turning in _turning(alone, order.numbers))


def _turning(race: Race, order: Sequence[int]) -> list[Candidate]:
    """The candidates not chosen whose block scores, summed in the order of the campaign, leave 0 furthest in a part of it."""
    size, taken = turns(race, order), {c.key for c in race.chosen}
    best: dict[Key, tuple[float, Candidate]] = {}
    for c in race.bank.candidates:
        if c.key not in taken and not c.own and (c.key not in best or size[list(c.columns)].max() > best[c.key][0]):
            best[c.key] = (float(size[list(c.columns)].max()), c)
    return [c for _, c in sorted(best.values(), key=lambda pair: -pair[0])[:ASKED]]


def _in_time(race: Race, table: Table, believed: StripTheory, candidate: Candidate, others: Sequence[Candidate], order: Order,
             ) -> Iterator[Judged]:
    """Spells of recordings, with the moment within one where there is one."""
    best = in_a_row(race, candidate, others, order.numbers)
    if best is None:
        return
    if race.total() - best[0] > LEAST / 2:
        one = judged(race, table, believed, candidate, others, order.spell(best[1]), 2.0 * len(order))
        yield from (one, *_sharper(race, table, believed, one, order))
    if others and candidate not in race.chosen:
        return  # what comes and goes explains too much of what another one's shape leaves
    some = by_turns(race, candidate, others, order.numbers, best[1])
    if some is not None and race.total() - some[0] > LEAST and (some[1] != best[1]).any():
        yield judged(race, table, believed, candidate, others, order.spell(some[1]), 2.0 ** len(order))


def _sharper(race: Race, table: Table, believed: StripTheory, one: Judged, order: Order) -> Iterator[Judged]:
    """The spell with the moment at which it begins or ends within a recording, where rows say so."""
    begins = one.spell.since is not None
    edge = order.names.index(str(one.spell.since if begins else one.spell.until))
    near = order.names[max(edge - begins, 0):edge + 1 + (not begins)]
    instance, others = one.candidate.instance, [c.instance for c in one.others]
    made = race_of(table, [*others, replace(instance, spell=one.spell)], believed, None, race.noise)
    theta = made.bench.scored(columns_of(made.bank.candidates), own_of(made.bank.candidates)).theta[:-len(one.beta)]
    found = moment(left_by(table, believed, instance, others, theta, race.noise), one.beta, near, begins)
    if found is None or found[0] < LEAST:
        return
    _, place, name, t = found
    spell = Spell(begin=place, since=name, since_s=t) if begins else Spell(end=place, until=name, until_s=t)
    here = order.names.index(name)
    spell = replace(spell, throughout=frozenset(order.names[here + 1:] if begins else order.names[:here]))
    yield judged(race, table, believed, one.candidate, one.others, spell, 2.0 * sum(len(piece.t) for piece in table.pieces))


def _in_space(race: Race, table: Table, believed: StripTheory, others: Sequence[Candidate]) -> Iterator[Judged]:
    """The sectors of the joints' angles in which loads explain most beside `others`."""
    loads = [c for c in race.bank.candidates if isinstance(c.instance.effect, LoadEffect) and not c.own
             and c.key not in {other.key for other in others}]
    if any(c.own for c in others) or not loads:
        return
    instances = [*(c.instance for c in others), *(c.instance for c in loads)]
    made = race_of(table, instances, believed, None, race.noise)
    beside = made.bank.candidates[:len(others)]
    rows = projected(table, believed, [c.instance for c in loads], [c.instance for c in others], made.bench, race.noise)
    start = made.bench.p + sum(c.instance.width for c in beside)
    best: dict[tuple[Key, int], tuple[float, Candidate, Sector]] = {}  # each law of an effect has its own sector
    for c, placed in zip(loads, made.bank.candidates[len(others):], strict=True):
        for joint in range(1, len(race.noise) + 1):
            found = sector(rows, joint, made.bench.p - start + np.array(placed.columns))
            if found is None or not found[2].shows(c.instance.effect):
                continue
            law = (c.key, c.instance.width)
            if found[1] > LEAST and (law not in best or found[0] > best[law][0]):
                best[law] = (found[0], c, found[2])
    for _, c, where in sorted(best.values(), key=lambda one: -one[0])[:RIVALS]:
        yield judged(race, table, believed, c, others, Spell(sector=where), len(race.noise) * PARTS**2 / 2)


def _tried(race: Race, table: Table, believed: StripTheory, order: Order) -> Iterator[Judged]:
    """All spells that are worth a judgement."""
    asked = {(id(law), frozenset(id(o) for o in others)): (law, others) for c, others in _asked(race, order) for law in laws_of(race, c)}
    for candidate, others in asked.values():
        yield from _in_time(race, table, believed, candidate, others, order)
    beside = {frozenset(id(o) for o in others): others for _, others in asked.values()}
    for others in beside.values():
        yield from _in_space(race, table, believed, others)


def spelled(known: Race, table: Table, believed: StripTheory) -> list[Instance]:
    """Return the hypotheses that act in a spell, with it, at most one of each key."""
    order, race = Order.of(table), quieter(known)
    if len(order) < INSIDE + OUTSIDE:
        return []
    total, best = race.total(), dict[Key, tuple[float, Judged]]()
    for one in _tried(race, table, believed, order):
        gain, key = total - one.total, one.candidate.key
        known.log.append(f"{key[0]} joint {key[1]}: {gain:.1f} by acting {one.spell.sentence()}, {one.outside:.2f} of it outside, where "
                         f"{one.visible:.0f} could be seen")
        worth = gain - SOFT * log(one.options)
        fits = one.holds and gain >= LEAST and gain_p(gain, int(min(len(race.bank.candidates) * one.options, 1e15))) <= P_BLOCK
        if fits and (key not in best or worth > best[key][0]):
            best[key] = (worth, one)
    return [replace(one.candidate.instance, spell=one.spell) for _, one in sorted(best.values(), key=lambda pair: -pair[0])[:MOST]]


def in_the_same_part(race: Race, table: Table, believed: StripTheory, most: int) -> list[Instance]:
    """Return of every chosen effect that acts in a part the `most` best rivals that act there, too: which one it is, is decided there."""
    made = []
    for chosen in race.chosen:
        spell, others = chosen.instance.spell, [c.instance for c in race.chosen if c is not chosen]
        if spell is None:
            continue
        there = [replace(c.instance, spell=spell) for c in race.bank.candidates
                 if c.instance.spell is None and not c.own and c.key not in {other.key for other in race.chosen}
                 and (spell.sector is None or spell.sector.shows(c.instance.effect))]
        contest = race_of(table, [*others, chosen.instance, *there], believed, None, race.noise)
        contest.chosen = list(contest.bank.candidates[:len(others) + 1])
        best = ranked(contest, contest.bank.candidates, [contest.chosen[-1]])[: most + 1]
        made += [c.instance for _, c in best if c.key != chosen.key][:most]
    return made
