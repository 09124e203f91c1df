"""Effects that act in some recordings only: from one recording on, or up to one (a seal tightened after run 6, a current that turned).

    x_k -> x_k in the recordings of the spell, 0 in all others            score over all spells of the campaign's order

An effect has a spell where the score gains by it as much as chance would not, and what it does outside is small beside what it does inside.
Source: change point by likelihood, Page (1954), Biometrika 41; what counts as one is ours.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.blocks import Blocks
from nnhydro.diagnosis.instances import Instance, Spell
from nnhydro.diagnosis.locks import P_BLOCK, block_scores, opens, own_p
from nnhydro.diagnosis.race import UNPHYSICAL, Race, columns_of, own_of, price
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.table import Table

Array = NDArray[np.float64]
INSIDE, OUTSIDE = 4, 2  # recordings that a spell and the rest must hold
LEAST = 15.0  # score that a spell must gain
SMALL = 0.3  # what an effect does outside its spell, beside what it does inside
ASKED = 8  # candidates that were not chosen, and are asked whether they act in a spell


@final
@dataclass(frozen=True, eq=False)
class Found:
    """The best spell of one candidate: which units (units,) lie in it, the score with it, and what it does outside beside inside, and
    whether recordings in it are predicted better."""

    candidate: Candidate
    inside: NDArray[np.bool_]
    total: float
    outside: float
    better: bool


def in_order(table: Table) -> list[tuple[int, str]]:
    """Return (number among the units that hold rows, name) of the moving units in the order of the campaign."""
    numbers = sorted({piece.number for piece in table.pieces})
    found = []
    for index, number in enumerate(numbers):
        unit = table.case.all_units[number]
        first = table.case.places(unit, 0) if not unit.steady else None
        if first is not None and len(first):
            found.append((float(first[0]), index, unit.name))
    return [(index, name) for _, index, name in sorted(found)]


def _spells(order: Sequence[int], units: int) -> Iterator[NDArray[np.bool_]]:
    """Every spell: from one recording on, or up to one; units without a place in the campaign are in none."""
    for k in range(1, len(order)):
        for part in (order[k:], order[:k]):
            if len(part) >= INSIDE and len(order) - len(part) >= OUTSIDE:
                yield np.isin(np.arange(units), part)


def _small(race: Race, kept: Sequence[Candidate]) -> tuple[Bench, dict[int, int]]:
    """A bench with the columns of `kept` alone, and where each of them stands."""
    columns = columns_of(kept)
    take = np.concatenate([race.bench.index(columns), [race.bench.total.shape[0] - 1]])
    blocks = race.bench.blocks
    small = Blocks(blocks.G[:, :, take[:, None], take[None, :]], blocks.n, blocks.unit, blocks.p)
    return Bench(small, race.bench.p, race.bench.prior), {int(k): place for place, k in enumerate(columns)}


def _masked(bench: Bench, columns: Sequence[int], inside: NDArray[np.bool_], both: bool = False) -> Bench:
    """The bench with `columns` (of its candidates) 0 outside the spell; with `both` they stand a second time, 0 inside it."""
    G, n = bench.blocks.G, bench.blocks.n
    place = bench.p + np.array(columns)
    if both:
        take = np.concatenate([np.arange(G.shape[2] - 1), place, [G.shape[2] - 1]])
        G = G[:, :, take[:, None], take[None, :]]
        again = np.arange(len(take) - 1 - len(place), len(take) - 1)
    else:
        G, again = G.copy(), place[:0]
    out = ~inside[bench.blocks.unit]
    for where, rows in ((place, out), (again, ~out)):
        hit = np.flatnonzero(rows)[:, None]
        G[hit, :, where[None, :], :] = 0.0
        G[hit, :, :, where[None, :]] = 0.0
    return Bench(Blocks(G, n, bench.blocks.unit, bench.p), bench.p, bench.prior)


def best_spell(race: Race, candidate: Candidate, order: Sequence[int]) -> Found | None:
    """Return the spell with which `candidate`, beside what else is chosen, predicts left-out recordings best; None where there is none."""
    kept = [*(c for c in race.chosen if c is not candidate), candidate]
    if own_of(kept).size:
        return None
    bench, where = _small(race, kept)
    mine, every = [where[k] for k in candidate.columns], np.arange(len(where))
    without = bench.scored(np.array([k for k in every if k not in mine], dtype=np.int64))
    best: Found | None = None
    for inside in _spells(order, len(bench.by_unit[1])):
        scored = _masked(bench, mine, inside).scored(every)
        total = scored.total + price(kept)
        if (best is None or total < best.total) and race.physical(kept, columns_of(kept), scored.theta[bench.p:]):
            best = Found(candidate, inside, total, 0.0, opens((without.by_unit - scored.by_unit)[inside]))
    if best is None:
        return None
    both = _masked(bench, mine, best.inside, both=True)
    theta = both.scored(np.arange(len(where) + len(mine))).theta[bench.p:]
    H = bench.total[np.ix_(bench.p + np.array(mine), bench.p + np.array(mine))]
    sizes = [float(np.sqrt(max(v @ H @ v, 0.0))) for v in (theta[mine], theta[len(where):])]
    return replace(best, outside=sizes[1] / max(sizes[0], 1e-300))


def _turning(race: Race, order: Sequence[int]) -> list[Candidate]:
    """The candidates not chosen whose block scores, summed in the order of the campaign, leave 0 furthest in a part of it."""
    U, _ = block_scores(race)
    by_unit = np.zeros((len(race.bench.by_unit[1]), U.shape[1]))
    np.add.at(by_unit, race.bench.blocks.unit, U)
    running = np.cumsum(by_unit[list(order)], axis=0)
    reach = np.maximum(np.abs(running).max(axis=0), np.abs(running[-1] - running).max(axis=0))
    size = reach / np.maximum(np.sqrt((U**2).sum(axis=0)), 1e-300)
    taken = {c.key for c in race.chosen}
    best: dict[tuple[str, int], tuple[float, Candidate]] = {}
    for c in race.bank.candidates:
        if c.key not in taken and not c.own and (c.key not in best or size[list(c.columns)].max() > best[c.key][0]):
            best[c.key] = (float(size[list(c.columns)].max()), c)
    return [c for _, c in sorted(best.values(), key=lambda pair: -pair[0])[:ASKED]]


def spelled(race: Race, table: Table) -> list[Instance]:
    """Return the chosen or nearly chosen hypotheses that act in a spell, with it."""
    order = in_order(table)
    if len(order) < INSIDE + OUTSIDE:
        return []
    places, names = [index for index, _ in order], [name for _, name in order]
    numbers = sorted({piece.number for piece in table.pieces})
    made, total = [], race.total()
    tried = len(race.bank.candidates) * 2 * len(order)
    for candidate in [*race.chosen, *_turning(race, places)]:
        found = best_spell(race, candidate, places)
        if found is None or found.total >= UNPHYSICAL or found.outside > SMALL or not found.better:
            continue
        gain = total - found.total
        if gain < LEAST or own_p(gain, tried) > P_BLOCK:
            continue
        active = [name for index, name in order if found.inside[index]]
        spell = Spell(frozenset(numbers[i] for i in np.flatnonzero(found.inside)), active[0] if active[0] != names[0] else None,
                      active[-1] if active[-1] != names[-1] else None)
        race.log.append(f"{candidate.key[0]} joint {candidate.key[1]}: gains {gain:.1f} by acting {spell.sentence()}, "
                        f"{found.outside:.2f} of it outside")
        made.append(replace(candidate.instance, spell=spell))
    return made
