"""Effects that the data cannot distinguish from a finding, its confidence, and the simpler effect where both are equivalent."""

from dataclasses import dataclass
from typing import final

import numpy as np

from nnhydro.diagnosis.constants import FORM, LEAST_GAIN
from nnhydro.diagnosis.decision.alternative_laws import EQUIVALENT_COSINE, cosine_of_torques, parameter_count, signal_count
from nnhydro.diagnosis.decision.catalogue_probability import listed_probability
from nnhydro.diagnosis.problem.hypothesis import Key
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search

EQUIVALENT_SHARE = FORM / 2  # share of a finding's gain; an effect of equal torque that is behind by less is equivalent


@final
@dataclass(frozen=True, eq=False)
class Rival:
    """An effect that could take a finding's place: nats behind it, its weight, whether the data cannot distinguish it from the finding."""

    number: int
    deficit: float
    weight: float
    cosine: float
    equivalent: bool


def replace_by_simpler(search: Search, found: ScoredSet) -> ScoredSet:
    """Return `found` with each member replaced by the equivalent effect of the fewest parameters, on no more signals.

    Never by the general form of a family, nor by an effect that gains too little to be claimed.
    """
    for k in found.chosen:
        rest = found.without(k)
        base = search.score(rest)
        _, others = rivals_of(search, found, k)
        near = [rival.number for rival in others if rival.equivalent and rival.deficit < LEAST_GAIN
                and parameter_count(search, rival.number) < parameter_count(search, k)
                and signal_count(search, rival.number) <= signal_count(search, k)
                and not search.view.library.hypotheses[rival.number].effect.general
                and search.gain(base, search.score((*rest, rival.number))) > LEAST_GAIN]
        if near:
            least = min(parameter_count(search, n) for n in near)
            found = max((search.score((*rest, n)) for n in near if parameter_count(search, n) == least), key=lambda s: s.score)
    return found


def _resembling(search: Search, base: ScoredSet, k: int) -> list[int]:
    """Return the best laws of the standard terms of its joint for which the card of member `k` may be taken, and the other way round.

    Every joint has them: they are rivals even if many special laws would gain more.
    """
    hypotheses, taken = search.view.library.hypotheses, search.occupied_places(base.chosen)
    effect, laws = hypotheses[k].effect, dict[Key, list[int]]()
    for i, hypothesis in enumerate(hypotheses):
        other = hypothesis.effect
        alike = other.id in effect.signature.mistaken_for or effect.id in other.signature.mistaken_for
        free = hypothesis.key != hypotheses[k].key and search.place(i) not in taken
        if other.standard and alike and other.joint == effect.joint and free:
            laws.setdefault(hypothesis.key, []).append(i)
    return [i for among in laws.values() for i in search.most_gaining(base, among, 1)]


def rivals_of(search: Search, found: ScoredSet, k: int) -> tuple[float, list[Rival]]:
    """Return the confidence in the name of member `k`, its equivalents included, and what could take its place, best first."""
    rest = found.without(k)
    base = search.score(rest)
    best: dict[Key, tuple[float, int]] = {}
    for number in (*search.screen(rest), *_resembling(search, base, k)):
        score = search.score((*rest, number)).score
        if search.key(number) != search.key(k) and score > best.get(search.key(number), (-np.inf, 0))[0]:
            best[search.key(number)] = score, number
    numbers = [number for _, number in best.values()]
    sets = [search.score((*rest, number)) for number in numbers]
    deficits = [found.score - scored.score for scored in sets]
    floor = np.exp(-max(search.gain(base, found), 0.0))
    taking = np.array([search.admits(base, scored) for scored in sets], dtype=float)  # what takes nothing from the unknown is no rival
    weights = np.exp(-np.maximum(deficits, 0.0)) * taking if deficits else np.zeros(0)
    total = 1.0 + floor + weights.sum()
    made = []
    for scored, number, deficit, weight in zip(sets, numbers, deficits, weights.tolist(), strict=True):
        cosine = cosine_of_torques(search, found, k, scored, number)
        no_wider = parameter_count(search, number) <= parameter_count(search, k)  # a general law holds the finding's own
        alike = no_wider and cosine > EQUIVALENT_COSINE and deficit < EQUIVALENT_SHARE * max(search.gain(base, found), 0.0)
        equivalent = search.admits(base, scored) and (deficit < LEAST_GAIN or alike)
        made.append(Rival(number, deficit, weight / total, cosine, equivalent))
    inside = (1.0 + sum(rival.weight * total for rival in made if rival.equivalent)) / total
    return float(inside * listed_probability(search, found, k)), sorted(made, key=lambda a: a.deficit)
