"""Select what was left out: likelihood gain ranks, the locks decide, swaps and pruning make the order of discovery irrelevant."""

from collections.abc import Sequence

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.locks import passes
from nnhydro.diagnosis.race import Race, ranked

MOST = 5
SWAP = 2.0  # score that a swap must gain
TRIED = 5  # candidates that may stand in for the best where that fails a lock
NEARLY = 0.3  # of the best one's gain
LEAST_OF_FIRST = 0.02  # a further effect gains at least this share of what the first one gained


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
            if dropped - gain < now - SWAP and best != candidate:
                race.chosen[race.chosen.index(candidate)] = best
                changed = True
                break
        if not changed:
            return


def run(race: Race, seed: int) -> Race:
    """Add, swap and prune until the best remaining candidate fails a lock; returns the race with its choice."""
    while len(race.chosen) < MOST:
        found = _next(race, seed + len(race.chosen))
        if found is None:
            break
        race.first_gain = max(race.first_gain, found[0])
        race.chosen.append(found[1])
        _improve(race, race.bank.candidates)
    return race


def _next(race: Race, seed: int) -> tuple[float, Candidate] | None:
    """The best candidate that passes the locks, among those that gain nearly as much as the very best."""
    order = ranked(race, race.bank.candidates)
    least = max(0.0, LEAST_OF_FIRST * race.first_gain, NEARLY * order[0][0] if order else 0.0)
    return next(((gain, c) for gain, c in order[:TRIED] if gain > least and passes(race, c, gain, seed)), None)
