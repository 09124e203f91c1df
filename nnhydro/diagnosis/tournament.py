"""Select what was left out: likelihood gain ranks, the locks decide, swaps, merging and pruning make the order of discovery irrelevant."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.locks import passes
from nnhydro.diagnosis.race import Race, ranked

MOST = 5
SWAP = 2.0  # score that a swap must gain
TRIED = 5  # candidates that may stand in for the best where that fails a lock
NEARLY = 0.3  # of the best one's gain
TOGETHER, PAIRS = 20.0, 3  # gain from which partners are sought, and pairs that are tried
LEAST_OF_FIRST = 0.02  # a further effect gains at least this share of what the first one gained


def _improve(race: Race, bank: Sequence[Candidate]) -> None:
    """Drop, swap or merge chosen candidates while the score gains by it."""
    for _ in range(2 * MOST):
        if not (_drop_or_swap(race, bank) or _merge(race, bank)):
            return


def _drop_or_swap(race: Race, bank: Sequence[Candidate]) -> bool:
    """Drop a chosen candidate that no longer earns its price, or swap one for a better one; whether there was any."""
    now = race.total()
    for candidate in list(race.chosen):
        dropped = race.total(without=[candidate])
        if dropped <= now:
            race.chosen.remove(candidate)
            return True
        gain, best = ranked(race, bank, [candidate])[0]
        if dropped - gain < now - SWAP and best != candidate:
            race.chosen[race.chosen.index(candidate)] = best
            return True
    return False


def _merge(race: Race, bank: Sequence[Candidate]) -> bool:
    """Put one candidate in the place of two chosen ones that share what it does alone; whether there was any."""
    now = race.total()
    for pair in combinations(race.chosen, 2):
        gain, best = ranked(race, bank, pair)[0]
        if race.total(without=pair) - gain < now - SWAP:
            race.chosen[:] = [*(c for c in race.chosen if c not in pair), best]
            return True
    return False


def run(race: Race, seed: int) -> Race:
    """Improve what is chosen, then add, swap and prune until the best remaining candidates fail a lock; returns the race."""
    _improve(race, race.bank.candidates)
    while len(race.chosen) < MOST:
        found = _next(race, seed + len(race.chosen)) or _next_pair(race, seed + len(race.chosen))
        if not found:
            break
        race.first_gain = max(race.first_gain, sum(gain for gain, _ in found))
        race.chosen += [candidate for _, candidate in found]
        _improve(race, race.bank.candidates)
    return race


def run_again(race: Race, before: Race, seed: int) -> Race:
    """Return the race run from nothing, or from what was chosen `before` where that is another choice and ends better.

    What is chosen first decides what looks best second; a choice that was reached once is not lost by starting over.
    """
    fresh = run(race, seed)
    keys = {c.key for c in before.chosen}
    first = {c.key: c for c in reversed(race.bank.candidates)}
    if keys == {c.key for c in fresh.chosen} or not keys <= set(first):
        return fresh
    log = [*fresh.log, "as before"]
    kept = run(replace(race, chosen=[first[c.key] for c in before.chosen], log=log, first_gain=before.first_gain), seed)
    return kept if kept.total() < fresh.total() - SWAP else fresh


def _promising(race: Race) -> list[tuple[float, Candidate]]:
    """The candidates that gain nearly as much as the very best, and enough beside what was gained first; best first."""
    order = ranked(race, race.bank.candidates)
    least = max(0.0, LEAST_OF_FIRST * race.first_gain, NEARLY * order[0][0] if order else 0.0)
    return [(gain, c) for gain, c in order[:TRIED] if gain > least]


def _next(race: Race, seed: int) -> list[tuple[float, Candidate]]:
    """The best candidate that passes the locks; none where none does."""
    return next(([(gain, c)] for gain, c in _promising(race) if passes(race, c, gain, seed)), [])


def _next_pair(race: Race, seed: int) -> list[tuple[float, Candidate]]:
    """Where nothing is found alone, the best two candidates that pass the locks beside each other: effects can hide each other."""
    if race.chosen:
        return []
    pairs = [(gain + more, gain, one, more, other) for gain, one in _promising(race) if gain > TOGETHER
             for more, other in ranked(beside(race, one), race.bank.candidates)[:1] if more > NEARLY * gain]
    for whole, gain, one, more, other in sorted(pairs, key=lambda pair: -pair[0])[:PAIRS]:
        if passes(beside(race, one), other, more, seed) and passes(beside(race, other), one, whole - _gain(race, other), seed):
            return [(gain, one), (more, other)]
    return []


def beside(race: Race, candidate: Candidate) -> Race:
    """Return the race with `candidate` chosen, too; the log is the same."""
    return replace(race, chosen=[*race.chosen, candidate])


def _gain(race: Race, candidate: Candidate) -> float:
    return race.total() - race.total([candidate])
