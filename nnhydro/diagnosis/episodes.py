"""In which recordings an effect acts: from one on, up to one, or in some of them; algebra on Gram matrices a recording.

    x_k -> x_k in the recordings of the spell, 0 in all others            left-out score over the spells of the campaign's order

Source: change point by likelihood, Page (1954), Biometrika 41; recordings that are in or out by turns: clusters of two means.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.blocks import Blocks
from nnhydro.diagnosis.race import UNPHYSICAL, Race, columns_of, own_of, price
from nnhydro.diagnosis.score import Bench

Array = NDArray[np.float64]
Units = NDArray[np.bool_]
INSIDE, OUTSIDE = 4, 2  # recordings that a spell and the rest must hold
COARSE = 16  # turns that are tried at first, in a long campaign
TURNS = 8  # times that recordings are dealt anew


def _spells(order: Sequence[int], units: int, at: Iterable[int]) -> Iterator[tuple[int, Units]]:
    """Every spell from recording number k of the order on, or up to it; units without a place in the campaign are in none."""
    for k in at:
        for part in (order[k:], order[:k]):
            if len(part) >= INSIDE and len(order) - len(part) >= OUTSIDE:
                yield k, np.isin(np.arange(units), part)


class Small:
    """A bench with the columns of one candidate and of those that stand beside it, and no others."""

    def __init__(self, race: Race, candidate: Candidate, others: Sequence[Candidate]) -> None:
        self.race, self.kept = race, race.held([*others, candidate])
        self.columns = columns_of(self.kept)
        take = np.concatenate([race.bench.index(self.columns), [race.bench.total.shape[0] - 1]])
        blocks = race.bench.blocks
        small = Blocks(blocks.G[:, :, take[:, None], take[None, :]], blocks.n, blocks.unit, blocks.p)
        self.bench, self.every = Bench(small, race.bench.p, race.bench.prior), np.arange(len(self.columns))
        self.mine = np.flatnonzero(np.isin(self.columns, candidate.columns))

    def masked(self, inside: Units) -> Bench:
        """The bench with the candidate's columns 0 outside the spell."""
        G, place = self.bench.blocks.G.copy(), self.bench.p + self.mine
        hit = np.flatnonzero(~inside[self.bench.blocks.unit])[:, None]
        G[hit, :, place[None, :], :] = 0.0
        G[hit, :, :, place[None, :]] = 0.0
        return Bench(Blocks(G, self.bench.blocks.n, self.bench.blocks.unit, self.bench.p), self.bench.p, self.bench.prior)

    def total(self, inside: Units) -> float:
        """The left-out score with its price, lower is better."""
        scored = self.masked(inside).scored(self.every)
        physical = self.race.physical(self.kept, self.columns, scored.theta[self.bench.p:])
        return scored.total + price(self.kept) if physical else UNPHYSICAL

    def dealt(self, inside: Units) -> Units:
        """The units (of those in `inside` or not) that the candidate, as it is fitted to the spell, brings nearer to the torque."""
        theta = self.masked(inside).scored(self.every).theta
        G, _ = self.bench.by_unit
        place, beta = self.bench.p + self.mine, theta[self.bench.p + self.mine]
        rest = np.where(np.isin(np.arange(len(theta)), place), 0.0, theta)
        g = G[:, :, place, -1].sum(axis=1) - np.einsum("ujkq,q->uk", G[:, :, place, :-1], rest)
        H = G[:, :, place[:, None], place[None, :]].sum(axis=1)
        gained: Array = 2 * g @ beta - np.einsum("k,ukl,l->u", beta, H, beta)
        return gained > 0


def in_a_row(race: Race, candidate: Candidate, others: Sequence[Candidate], order: Sequence[int]) -> tuple[float, Units] | None:
    """Return the best score with a spell from one recording on, or up to one, and its units; None where there is none."""
    if own_of([*others, candidate]).size:
        return None
    small, step = Small(race, candidate, others), -(-len(order) // COARSE)

    def best(at: Iterable[int]) -> tuple[float, int, Units] | None:
        tried = [(small.total(inside), k, inside) for k, inside in _spells(order, len(small.bench.by_unit[1]), at)]
        return min(tried, key=lambda one: one[0], default=None)

    found = best(range(step, len(order), step))
    if found is not None and step > 1:
        found = best(range(found[1] - step + 1, found[1] + step))
    return (found[0], found[2]) if found is not None and found[0] < UNPHYSICAL else None


def by_turns(race: Race, candidate: Candidate, others: Sequence[Candidate], order: Sequence[int],
             start: Units) -> tuple[float, Units] | None:
    """Return the best score with a spell of any recordings, dealt from those in `start`; None where it settles on too few or nearly all."""
    small, units = Small(race, candidate, others), np.isin(np.arange(len(start)), order)
    inside = start
    for _ in range(TURNS):
        again = small.dealt(inside) & units
        if not INSIDE <= again.sum() <= len(order) - OUTSIDE:
            return None
        if (again == inside).all():
            break
        inside = again
    total = small.total(inside)
    return (total, inside) if total < UNPHYSICAL else None
