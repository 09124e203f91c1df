"""Select what was left out: likelihood gain ranks, two locks decide, swaps and pruning make the order of discovery irrelevant.

Lock 1  family-wise block test: the largest standardised block score over the whole bank, against its distribution under random signs of the
        blocks (Rademacher multipliers): one p with the look-elsewhere effect paid.
Lock 2  recordings left out of the fit must be predicted better: Wilcoxon's signed ranks on the per-recording log ratio.
Besides, a finding must be material: at least 1 % of the residual energy of a joint on left-out recordings.
Source: diagnosis method of this project (docs/decisions.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.blocks import Blocks
from nnhydro.diagnosis.score import Bench, Scored

Array = NDArray[np.float64]
SIGNS = 999
P_BLOCK, P_LEFT_OUT = 0.01, 0.05
MATERIAL = 0.01
MOST = 5
CANCELLING = 0.5  # an effect whose own torque exceeds this share of the measured energy only lives by cancelling another
UNPHYSICAL = 1e12  # score of a set with a value beyond its physical bounds
LEAST_OF_FIRST = 0.02  # a further effect gains at least this share of what the first one gained
PER_COLUMN = 1.0  # score a further column must earn beyond what left-out prediction already charges
PER_GRID = 0.5  # times log(number of grid points): price of choosing a nonlinear parameter


@final
@dataclass(frozen=True)
class Candidate:
    """One hypothesis at one joint (0: the arm) and one value of its nonlinear parameters: its columns in the bank."""

    effect: str
    joint: int
    place: int  # which grid point
    grid: int  # how many grid points there are
    columns: tuple[int, ...]

    @property
    def key(self) -> tuple[str, int]:
        """What is claimed: effect and joint."""
        return self.effect, self.joint


@final
@dataclass
class Race:
    """The state of the selection: chosen candidates and their left-out score."""

    bench: Bench
    blocks: Blocks  # weighted as the bench
    noise: Array  # (joints,) N m
    low: Array  # (K,) physical bounds of each candidate column's value
    high: Array  # (K,)
    torque: float  # energy of the measured torque in units of the noise
    chosen: list[Candidate] = field(default_factory=list)
    log: list[str] = field(default_factory=list)
    first_gain: float = 0.0

    def columns(self, extra: Sequence[Candidate] = (), without: Sequence[Candidate] = ()) -> NDArray[np.int64]:
        """Return the chosen columns, plus `extra`, less `without`."""
        kept = [c for c in self.chosen if c not in without] + list(extra)
        return np.array(sorted({k for c in kept for k in c.columns}), dtype=np.int64)

    def _energy(self, candidate: Candidate, columns: NDArray[np.int64], values: Array) -> float:
        """Energy of one candidate's own torque in units of the noise."""
        own = np.array(candidate.columns)
        beta = values[np.searchsorted(columns, own)]
        place = self.bench.p + own
        return float(beta @ self._total[np.ix_(place, place)] @ beta)

    @cached_property
    def _total(self) -> Array:
        total: Array = self.bench.G.sum(axis=(0, 1))
        return total

    def price(self, candidates: Sequence[Candidate]) -> float:
        """What the candidates must earn for their columns and grids."""
        return sum(PER_COLUMN * len(c.columns) + PER_GRID * float(np.log(c.grid)) for c in candidates)

    def total(self, extra: Sequence[Candidate] = (), without: Sequence[Candidate] = ()) -> float:
        """Left-out score with its price, lower is better; `UNPHYSICAL` where a value leaves its physical bounds."""
        kept = [c for c in self.chosen if c not in without] + list(extra)
        columns = self.columns(extra, without)
        scored = self.bench.scored(columns)
        values = scored.theta[self.bench.p:]
        if len(columns) and not ((values >= self.low[columns]) & (values <= self.high[columns])).all():
            return UNPHYSICAL
        if any(self._energy(c, columns, values) > CANCELLING * self.torque for c in kept):
            return UNPHYSICAL
        return scored.total + self.price(kept)


def ranked(race: Race, bank: Sequence[Candidate], without: Sequence[Candidate] = ()) -> list[tuple[float, Candidate]]:
    """Return (gain, candidate), best first: the best grid point of every (effect, joint) that is not chosen yet."""
    now = race.total(without=without)
    taken = {c.key for c in race.chosen if c not in without}
    best: dict[tuple[str, int], tuple[float, Candidate]] = {}
    for candidate in bank:
        if candidate.key in taken:
            continue
        gain = now - race.total([candidate], without)
        if candidate.key not in best or gain > best[candidate.key][0]:
            best[candidate.key] = (gain, candidate)
    return sorted(best.values(), key=lambda pair: -pair[0])


def block_scores(race: Race) -> tuple[Array, Array]:
    """Return U (blocks, K), each candidate column's projected product with the residual, and the columns' projected energy (K,)."""
    take = race.bench.index(race.columns())
    G = race.blocks.G.sum(axis=1)  # weighted, joints summed: (blocks, P, P)
    total = G.sum(axis=0)
    p, K = race.blocks.p, race.blocks.K
    every = np.arange(p, p + K)
    penalty = np.concatenate([race.bench.prior, np.zeros(len(take) - p)]) + 1e-8 * np.diag(total)[take] + 1e-12
    A = total[np.ix_(take, take)] + np.diag(penalty)
    solved = np.linalg.solve(A, total[np.ix_(take, [*every, total.shape[0] - 1])])
    B, theta = solved[:, :-1], solved[:, -1]
    gX = G[:, every, -1] - np.einsum("bkq,q->bk", G[:, every[:, None], take[None, :]], theta)
    gY = G[:, take, -1] - np.einsum("bqr,r->bq", G[:, take[:, None], take[None, :]], theta)
    energy = np.diag(total)[every] - (total[np.ix_(every, take)] * B.T).sum(axis=1)
    return gX - gY @ B, np.maximum(energy, 0.0)


def family_wise_p(race: Race, seed: int) -> tuple[float, Array]:
    """Return the p of "nothing is missing" over the whole bank, and each column's own statistic (K,).

    Each column enters twice: by its block scores and by their signed ranks, which a few violent blocks cannot drown.
    """
    from scipy.stats import rankdata

    U, energy = block_scores(race)
    spread = np.sqrt((U**2).sum(axis=0))
    alive = (energy > 1e-6 * np.maximum(np.diag(race.blocks.G.sum(axis=(0, 1)))[race.blocks.p:-1], 1e-300)) & (spread > 0)
    if not alive.any():
        return 1.0, np.zeros(U.shape[1])
    ranks = np.sign(U) * rankdata(np.abs(U), axis=0)
    both = [x / np.maximum(np.sqrt((x**2).sum(axis=0)), 1e-300) for x in (U, ranks)]
    scaled = np.concatenate([np.where(alive, x, 0.0) for x in both], axis=1)
    seen = np.abs(scaled.sum(axis=0))
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(SIGNS, len(U)))
    null = np.abs(signs @ scaled).max(axis=1)
    return float((1 + (null >= seen.max() - 1e-12).sum()) / (SIGNS + 1)), np.maximum(*np.split(seen, 2))


def left_out_p(before: Scored, after: Scored) -> float:
    """Return Wilcoxon's one-sided p of "left-out recordings are not predicted better"."""
    from scipy.stats import wilcoxon

    gains = before.by_unit - after.by_unit
    gains = gains[np.abs(gains) > 1e-9]
    if len(gains) < 4:
        return 1.0
    return float(wilcoxon(gains, alternative="greater").pvalue)


def material(before: Scored, after: Scored) -> float:
    """Return the largest share, over joints, of left-out residual energy that is gained."""
    a, b = before.energy.sum(axis=0), after.energy.sum(axis=0)
    return float(np.max((a - b) / np.maximum(a, 1e-300)))


def _passes(race: Race, candidate: Candidate, gain: float, seed: int) -> bool:
    before, after = race.bench.scored(race.columns()), race.bench.scored(race.columns([candidate]))
    p_block = family_wise_p(race, seed)[0]
    p_left_out, share = left_out_p(before, after), material(before, after)
    race.log.append(f"{candidate.effect} joint {candidate.joint}: gain {gain:.1f}, p_block {p_block:.3f}, p_left_out {p_left_out:.4f}, "
                    f"energy {share:.3f}")
    return p_block <= P_BLOCK and p_left_out <= P_LEFT_OUT and share >= MATERIAL and gain >= LEAST_OF_FIRST * race.first_gain


def _improve(race: Race, bank: Sequence[Candidate]) -> None:
    """Swap each chosen candidate for a better one and drop those that no longer earn their price, until nothing changes."""
    for _ in range(2 * MOST):
        changed = False
        for candidate in list(race.chosen):
            now, dropped = race.total(), race.total(without=[candidate])
            if dropped <= now:
                race.chosen.remove(candidate)
                changed = True
                break
            gain, best = ranked(race, bank, [candidate])[0]
            if dropped - gain < now - 2.0 and best != candidate:
                race.chosen[race.chosen.index(candidate)] = best
                changed = True
                break
        if not changed:
            return


def run(race: Race, bank: Sequence[Candidate], seed: int) -> Race:
    """Add, swap and prune until the best remaining candidate fails a lock; returns the race with its choice."""
    while len(race.chosen) < MOST:
        order = ranked(race, bank)
        if not order or order[0][0] <= 0:
            break
        gain, candidate = order[0]
        if not _passes(race, candidate, gain, seed + len(race.chosen)):
            break
        race.first_gain = max(race.first_gain, gain)
        race.chosen.append(candidate)
        _improve(race, bank)
    return race
