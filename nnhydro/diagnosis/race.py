"""The state of the selection: which candidates stand beside the baseline, and what the set costs and explains."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Bank, Candidate, build
from nnhydro.diagnosis.batch import scores
from nnhydro.diagnosis.blocks import Blocks
from nnhydro.diagnosis.instances import Instance
from nnhydro.diagnosis.noise import noise_of, quiet_noise
from nnhydro.diagnosis.score import Bench, Scored
from nnhydro.diagnosis.table import Table
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
Index = NDArray[np.int64]
LARGE = 0.5  # of the measured energy: an effect of more torque than that must be seen in the measured torque itself,
OPPOSED = 0.1  # of its own energy: what the rest of the model may take back of it
MOST_HELD = 8  # values
SLACK = 10.0  # of score: a candidate that is worse by that before values are held is no better with them
UNPHYSICAL = 1e12  # score of a set with a value beyond its physical bounds
PER_COLUMN = 1.0  # score a further column must earn beyond what left-out prediction already charges
PER_GRID = 0.5  # times log(number of grid points): price of choosing a nonlinear parameter


@final
@dataclass
class Race:
    """The bank on its bench, and what is chosen so far."""

    bank: Bank
    bench: Bench
    noise: Array  # (joints,) N m
    chosen: list[Candidate] = field(default_factory=list)
    log: list[str] = field(default_factory=list)
    first_gain: float = 0.0

    @property
    def torque(self) -> float:
        """Energy of the measured torque in units of the noise."""
        return float((self.bank.torque / self.noise**2).sum())

    def kept(self, extra: Sequence[Candidate] = (), without: Sequence[Candidate] = ()) -> list[Candidate]:
        """Return the chosen candidates, plus `extra`, less `without`, those values held at 0 that the fit would take below it."""
        return self.held([c for c in self.chosen if c not in without] + list(extra))

    def held(self, kept: Sequence[Candidate]) -> list[Candidate]:
        """Return `kept` with the values held at 0, their least one, that a fit of all would take below it: an active set.

        The one that lies farthest below is held first, in units of its column; one that would rise again beside the others is released.
        A candidate keeps at least one value that is fitted; the one that is left alone may leave its bounds.
        """
        whole = _without(kept, ())
        if not (self.bank.low[columns_of(whole)] == 0).any():
            return whole
        out: list[int] = []
        for _ in range(MOST_HELD):
            worst = self._lowest(_without(whole, out))
            if worst is None:
                break
            out.append(worst)
        for k in out[:-1]:  # the last one was below 0 beside exactly the others
            more = [other for other in out if other != k]
            if self._lowest(_without(whole, more)) is None:
                out = more
        return _without(whole, out)

    def _lowest(self, kept: Sequence[Candidate]) -> int | None:
        """The column of `kept` whose value lies farthest below its least one, 0, and that is not the last of its candidate; None: none."""
        columns = columns_of(kept)
        values = self.bench.scored(columns, own_of(kept)).theta[self.bench.p:]
        depth = values * np.sqrt(np.diag(self.bench.total)[self.bench.p + columns])
        alone = {c.free[0] for c in kept if len(c.free) == 1 and not c.own}
        found = zip(depth.tolist(), columns.tolist(), strict=True)
        below = [(d, k) for d, k in found if d < 0 and self.bank.low[k] == 0 and k not in alone]
        return min(below)[1] if below else None

    def scored(self, extra: Sequence[Candidate] = (), without: Sequence[Candidate] = ()) -> Scored:
        """Return the left-out score of the set."""
        kept = self.kept(extra, without)
        return self.bench.scored(columns_of(kept), own_of(kept))

    def total(self, extra: Sequence[Candidate] = (), without: Sequence[Candidate] = ()) -> float:
        """Left-out score with its price, lower is better; `UNPHYSICAL` where a value leaves its physical bounds."""
        kept = self.kept(extra, without)
        columns = columns_of(kept)
        scored = self.bench.scored(columns, own_of(kept))
        return scored.total + price(kept) if self.physical(kept, columns, scored.theta[self.bench.p:]) else UNPHYSICAL

    def loss(self, chosen: Candidate) -> float:
        """Return what the left-out score loses without the `chosen` candidate, whatever values the others then take."""
        return self.scored(without=[chosen]).total - self.scored().total

    def physical(self, kept: Sequence[Candidate], columns: Index, values: Array) -> bool:
        """Return whether the `values` of `columns` lie within their bounds and no effect lives by cancelling another."""
        if len(columns) and not ((values >= self.bank.low[columns]) & (values <= self.bank.high[columns])).all():
            return False
        found = dict(zip(columns.tolist(), values.tolist(), strict=True))
        if not all(c.instance.plausible(np.array([found.get(k, 0.0) for k in c.columns])) for c in kept if not c.own):
            return False
        return not any(self._cancels(c, columns, values) for c in kept)

    def _cancels(self, candidate: Candidate, columns: Index, values: Array) -> bool:
        """Whether the candidate's torque a is large and not in the measured torque y, but lives by cancelling another's.

            |a|^2 > |y|^2 / 2   and   (y - a) . a < -|a|^2 / 10        a heavy payload is part of y; what cancels is taken back by the rest
        """
        if not candidate.free:
            return False
        own = np.array(candidate.free)
        beta, place = values[np.searchsorted(columns, own)], self.bench.p + own
        energy = float(beta @ self.bench.total[np.ix_(place, place)] @ beta)
        shared = float((self.bank.met[:, own] / self.noise[:, None] ** 2).sum(axis=0) @ beta)
        return energy > LARGE * self.torque and shared < (1 - OPPOSED) * energy

    def values(self, kept: Sequence[Candidate]) -> tuple[Array, dict[int, float]]:
        """Return the baseline's parameters (p,) and the value of every column of `kept`, all fitted together."""
        kept = self.held(kept)
        columns = columns_of(kept)
        theta = self.bench.scored(columns, own_of(kept)).theta
        zeros = {k: 0.0 for c in kept for k in c.columns}
        return theta[: self.bench.p], zeros | dict(zip(columns.tolist(), theta[self.bench.p:].tolist(), strict=True))


def race_of(table: Table, instances: Sequence[Instance], believed: StripTheory, repeats: tuple[float, ...] | None,
            noise: np.ndarray | None = None) -> Race:
    """Return a race over `instances` with nothing chosen; `noise` (joints,) N m is estimated where it is not given."""
    bank, blocks = build(table, instances, believed)
    ones = np.ones(blocks.p)
    noise = noise_of(_foreseen(bank, blocks), ones, repeats) if noise is None else noise
    return Race(bank, Bench.of(blocks, noise, ones), noise)


def _foreseen(bank: Bank, blocks: Blocks) -> Blocks:
    """The Gram matrices without the columns that follow a real arm's misfit as if it were no noise.

    Those are settled values that nobody has fitted, and what looks at the measured torque.
    """
    out = [blocks.p + k for c in bank.candidates if c.instance.start or c.instance.effect.reads_torque for k in c.columns]
    if not out:
        return blocks
    take = np.setdiff1d(np.arange(blocks.G.shape[2]), out)
    return Blocks(blocks.G[:, :, take[:, None], take[None, :]], blocks.n, blocks.unit, blocks.p)


def quieter(race: Race) -> Race:
    """Return the race on the noise of the quieter recordings, where that is less, with the same chosen."""
    bench = race.bench
    share = np.minimum(quiet_noise(bench.blocks, bench.prior), 1.0)
    blocks = Blocks(bench.blocks.G / share[None, :, None, None] ** 2, bench.blocks.n, bench.blocks.unit, bench.p)
    return replace(race, bench=Bench(blocks, bench.p, bench.prior), noise=race.noise * share)


def columns_of(kept: Sequence[Candidate]) -> Index:
    """Return the columns of `kept` with one value for all recordings that is fitted, in order."""
    return np.array(sorted({k for c in kept for k in c.free}), dtype=np.int64)


def own_of(kept: Sequence[Candidate]) -> Index:
    """Return the columns of `kept` with a value of their own in every recording, in order."""
    return np.array(sorted({k for c in kept for k in c.own}), dtype=np.int64)


def _without(kept: Sequence[Candidate], out: Collection[int]) -> list[Candidate]:
    """The candidates with their columns in `out` held at 0."""
    return [c.holding(place for place, k in enumerate(c.columns) if k in out) for c in kept]


def price(candidates: Sequence[Candidate]) -> float:
    """What the candidates must earn for their columns and grids; values of each recording's own are paid for where they are predicted."""
    return sum(PER_COLUMN * (len(c.columns) + len(c.own)) + PER_GRID * float(np.log(c.grid)) for c in candidates)


def _batched(race: Race, now: float, kept: Sequence[Candidate], tried: Sequence[Candidate],
             without: Sequence[Candidate]) -> dict[int, float]:
    """Total score of `kept`, the chosen less `without`, with each of `tried` (by its id), none of which has values of a recording's own.

    Where all values are free and within their bounds that is it; else with those held that are held without the candidate; else, where
    the score could be better than `now`, those are sought that are held with it.
    """
    whole = _free(race, _without(kept, ()), tried)
    held, found = _free(race, kept, tried) if any(c.held for c in kept) else whole, {}
    for c in tried:
        total, physical = whole[id(c)] if whole[id(c)][1] else held[id(c)]
        found[id(c)] = total if physical else UNPHYSICAL if total >= now + SLACK else race.total([c], without)
    return found


def _free(race: Race, kept: Sequence[Candidate], tried: Sequence[Candidate]) -> dict[int, tuple[float, bool]]:
    """Total score of `kept` with each of `tried` (by its id) without further values held, and whether all lie within their bounds."""
    columns, found = columns_of(kept), {}
    for width in sorted({len(c.columns) for c in tried}):
        same = [c for c in tried if len(c.columns) == width]
        totals, values = scores(race.bench, columns, [c.columns for c in same])
        for candidate, total, value in zip(same, totals.tolist(), values, strict=True):
            order = np.argsort(np.concatenate([columns, np.array(candidate.columns, dtype=np.int64)]))
            every = np.concatenate([columns, np.array(candidate.columns, dtype=np.int64)])[order]
            found[id(candidate)] = total + price([*kept, candidate]), race.physical([*kept, candidate], every, value[order])
    return found


def gains(race: Race, tried: Sequence[Candidate], without: Sequence[Candidate] = ()) -> list[tuple[float, Candidate]]:
    """Return the score that each of `tried` gains beside what is chosen, less `without`."""
    now, kept = race.total(without=without), race.kept(without=without)
    totals = _batched(race, now, kept, [c for c in tried if not c.own], without) if not own_of(kept).size else {}
    return [(now - (totals[id(c)] if id(c) in totals else race.total([c], without)), c) for c in tried]


def laws_of(race: Race, one: Candidate) -> list[Candidate]:
    """Return the candidate and other laws of its effect, of more or fewer columns, at the same joint in the same part."""
    spell, width = one.instance.spell, one.instance.width
    return [one, *(c for c in race.bank.candidates if c.key == one.key and c.instance.spell is spell and c.instance.width != width)]


def ranked(race: Race, bank: Sequence[Candidate], without: Sequence[Candidate] = ()) -> list[tuple[float, Candidate]]:
    """Return (gain, candidate), best first: the best grid point of every (effect, joint) that is not chosen yet."""
    taken = {c.key for c in race.chosen if c not in without}
    best: dict[tuple[str, int], tuple[float, Candidate]] = {}
    for gain, candidate in gains(race, [c for c in bank if c.key not in taken], without):
        if candidate.key not in best or gain > best[candidate.key][0]:
            best[candidate.key] = (gain, candidate)
    return sorted(best.values(), key=lambda pair: -pair[0])
