"""Search for the set of effects with the highest posterior: add, drop and swap from the best single and pair.

The score of a set (scored_set.py) grants that laws are known to FORM in form. That is granted beside other laws alone: the first must gain
beside the unknown as it is.
Sets are grown beside the unknown and, since laws that explain the torque together take little from it one by one, also without it.
Screening scores every law beside the current set at three scales of the unknown by Schur complements; only the best are fitted exactly.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import FEW_NATS, FORM, LEAST_GAIN, LEAVES, MOST_EFFECTS, RHO, SMALLEST_SIZE
from nnhydro.diagnosis.model.evidence import WhiteRows, posterior
from nnhydro.diagnosis.model.sizes import Sizes, none
from nnhydro.diagnosis.problem.hypothesis import Key
from nnhydro.diagnosis.search.library import log_mass
from nnhydro.diagnosis.search.scored_set import IMPOSSIBLE, ScoredSet, imitated_nats, makes_sense, score_set
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary

if TYPE_CHECKING:
    from nnhydro.diagnosis.search.best_fit import BestFit
    from nnhydro.diagnosis.search.tangents import Tangents

Array = NDArray[np.float64]
SCREENED = (1.0, 1 / 3, 0.0)  # scales of the unknown at which every law is screened
FITTED_EXACTLY = 5  # effects per scale whose best law is fitted exactly


@final
@dataclass(eq=False)
class Search:
    """Scores of sets, each computed once, and moves between them."""

    view: WeightedLibrary
    start: Sizes
    report: Callable[[str], None] = lambda line: None
    settled: frozenset[Key] = frozenset()  # keys of instruments found about their values: laws about none, and rough starts, are out
    best_fits: "dict[tuple[int, ...], BestFit]" = field(default_factory=dict)  # by set (search.best_fit)
    tangents: "dict[tuple[int, ...], Tangents | None]" = field(default_factory=dict)  # of these (search.tangents)
    quotients: "dict[tuple[int, str], dict[float, Array]]" = field(default_factory=dict)  # of members and their values, by the step
    _scored: dict[tuple[int, ...], ScoredSet] = field(default_factory=dict)
    _unknown_nats: dict[tuple[tuple[int, ...], tuple[int, ...]], float] = field(default_factory=dict)

    @property
    def whitened(self) -> WhiteRows:
        """The rows and their noise."""
        return self.view.whitened

    def key(self, k: int) -> Key:
        """Return effect and joint of hypothesis `k`."""
        return self.view.library.hypotheses[k].key

    def score(self, chosen: Sequence[int]) -> ScoredSet:
        """Return the set `chosen`, fitted with the unknown's best sizes."""
        key = tuple(sorted(chosen))
        if key not in self._scored:
            self._scored[key] = score_set(self.view, self.start, key)
        return self._scored[key]

    def _possible(self, found: ScoredSet) -> ScoredSet:
        """Return `found`, without the members whose values make no sense where the others do not take what they are not there for."""
        if found.score > IMPOSSIBLE / 2:
            return found
        return self.score([k for k, at in found.places(self.view).items() if makes_sense(self.view, k, found.fit.mean[at])])

    def occupied_places(self, chosen: Sequence[int]) -> set[tuple[str, int]]:
        """Return the places (cause, joint) that `chosen` hold: one law of a cause at a place."""
        return {self.place(k) for k in chosen}

    def place(self, k: int) -> tuple[str, int]:
        """Return cause and joint of hypothesis `k`."""
        effect = self.view.library.hypotheses[k].effect
        return effect.cause or effect.family, effect.joint

    @cached_property
    def _most_granted(self) -> Array:
        """The log prior of every law and the most that its physical bounds can gain: the values within are more probable by as much."""
        library = self.view.library
        low, high = library.spans
        free = np.isinf(low) & np.isinf(high)
        within = np.where(free, 0.0, log_mass(low, high, np.zeros_like(low), np.full_like(low, RHO)))
        made = []
        for k, hypothesis in enumerate(library.hypotheses):
            sets = len(self.view.acting_groups(k)) if hypothesis.per_recording else 1
            made.append(library.log_prior(k) - sets * float(within[library.at(k)].sum()))
        return np.array(made)

    def screen(self, chosen: Sequence[int], most: int = FITTED_EXACTLY) -> list[int]:
        """Return the hypotheses most worth fitting beside `chosen`: the best law of a key, by its score at the unknown's best scale."""
        now, columns = self.score(chosen), self.view.join(sorted(chosen))
        library, taken = self.view.library, self.occupied_places(chosen)
        outdated = np.array([hypothesis.key in self.settled and (hypothesis.working_model is None or hypothesis.rough)
                             for hypothesis in library.hypotheses], dtype=bool)
        best: dict[Key, tuple[float, int]] = {}
        for scale in SCREENED:
            sizes = none(self.whitened) if scale == 0 else now.sizes.times(scale)
            fit = posterior(self.whitened, columns, sizes.vector(self.whitened))
            total = np.where(outdated, -np.inf, self.view.gains(sorted(chosen), fit) + self._most_granted + fit.log_evidence)
            seen: set[Key] = set()
            for k in np.argsort(-total).tolist():
                if self.key(k) in seen or self.place(k) in taken or outdated[k]:
                    continue
                seen.add(self.key(k))
                bonus = 0.0 if len(seen) > 1 else 1e9  # the best of every scale is fitted
                if total[k] + bonus > best.get(self.key(k), (-np.inf, 0))[0]:
                    best[self.key(k)] = float(total[k]) + bonus, k
                if len(seen) >= most:
                    break
        return [k for _, k in sorted(best.values(), reverse=True)[:most]]

    def most_gaining(self, base: ScoredSet, among: Sequence[int], most: int = FITTED_EXACTLY) -> list[int]:
        """Return those of the hypotheses `among` that gain most beside `base`, the unknown at its sizes and switched off."""
        columns, granted = self.view.join(base.chosen), self._most_granted[list(among)]
        best: set[int] = set()
        for sizes in (base.sizes, none(self.whitened)):
            gains = self.view.gains(base.chosen, posterior(self.whitened, columns, sizes.vector(self.whitened)))
            best |= {among[i] for i in np.argsort(-(gains[list(among)] + granted))[:most].tolist()}
        return sorted(best)

    def gain(self, now: ScoredSet, then: ScoredSet) -> float:
        """Return the nats that `then` gains beside what is possible of `now`; beside nothing, less what is granted to form."""
        now = self._possible(now)
        granted = 0.0 if now.chosen else FORM**2 * (now.unknown_nats - then.unknown_nats)
        return then.score - now.score - granted

    def admits(self, now: ScoredSet, then: ScoredSet) -> bool:
        """Return whether `then` is more probable than `now` and replaces the unknown as a true law would."""
        return self.gain(now, then) > 1e-6 and self.share_left(now, then) <= LEAVES

    def share_left(self, now: ScoredSet, then: ScoredSet) -> float:
        """Return the share that `then` leaves of what there is to explain beside `now`: 0 of a cause, near 1 of what only resembles it.

            (m - (n(now) - n(then))) / (m + gain),    m = min(n(now), (u'u - |u less what the unknown makes of it|^2) / 2)

        n(S): nats that the unknown gains beside S at the joints loaded; u: the torque of the laws. The gain is what the unknown cannot make
        of it: for clipping, or a phase per recording, that is most of it. In a part of the campaign, which was chosen for
        its gain, it counts nothing. A standard term of a joint need not explain more than its own torque, however large the unknown is:
        that it is there, and small, was probable before.
        """
        more = sorted(set(then.chosen) - set(now.chosen))
        before, after = self.nats_of_unknown(now, more), self.nats_of_unknown(then, more)
        if after <= FEW_NATS:
            return 0.0
        if all(self.view.library.hypotheses[k].effect.standard for k in more):
            theirs = min(before, sum(imitated_nats(self.view, then, k) for k in more))
        else:
            theirs = before
        whole = all(self.view.library.hypotheses[k].activity is None for k in more)
        return (theirs - (before - after)) / max(theirs + (max(self.gain(now, then), 0.0) if whole else 0.0), FEW_NATS)

    def nats_of_unknown(self, found: ScoredSet, laws: Iterable[int]) -> float:
        """Return the nats that the unknown gains beside `found` at the joints that `laws` load: what other joints hold is not theirs."""
        loaded = np.any([self.view.columns(k).Xw.any(axis=(0, 2)) for k in laws], axis=0)
        if np.all(loaded):
            return found.unknown_nats
        at = found.chosen, tuple(np.flatnonzero(loaded).tolist())
        if at not in self._unknown_nats:
            elsewhere = Sizes(np.where(loaded[:, None], SMALLEST_SIZE, found.sizes.tau))
            fit = posterior(self.whitened, self.view.join(found.chosen), elsewhere.vector(self.whitened))
            self._unknown_nats[at] = max(found.fit.log_evidence - fit.log_evidence, 0.0)
        return self._unknown_nats[at]

    def _better(self, now: ScoredSet, sets: Sequence[Sequence[int]], base: ScoredSet | None = None) -> ScoredSet:
        base = now if base is None else base
        found = [s for s in map(self.score, sets) if self.admits(base, s)]
        return max([now, *found], key=lambda s: s.score)

    def singles(self) -> list[ScoredSet]:
        """Return the best laws alone, best first."""
        return sorted((self.score((k,)) for k in self.screen((), 2 * FITTED_EXACTLY)), key=lambda s: -s.score)

    def run(self) -> ScoredSet:
        """Return the best set found."""
        empty, singles = self.score(()), self.singles()
        best = self._better(empty, [scored.chosen for scored in singles])
        for first in singles[:4]:
            best = self._better(best, [(*first.chosen, k) for k in self.screen(first.chosen)], empty)
        return self.climb(self._better(best, self._grow_sets(), empty))

    def _grow_sets(self) -> list[tuple[int, ...]]:
        """Return the sets that grow by the law that gains most while the unknown is switched off."""
        off = none(self.whitened).vector(self.whitened)
        sets: list[tuple[int, ...]] = [()]
        while len(sets) <= MOST_EFFECTS:
            columns, taken = self.view.join(sorted(sets[-1])), self.occupied_places(sets[-1])
            total = self.view.gains(sorted(sets[-1]), posterior(self.whitened, columns, off)) + self._most_granted
            following = next((k for k in np.argsort(-total).tolist() if self.place(k) not in taken), None)
            if following is None or total[following] <= LEAST_GAIN:
                break
            sets.append((*sets[-1], following))
        return sets[1:]

    def climb(self, best: ScoredSet) -> ScoredSet:
        """Return the best set reached from `best` by adding, dropping and swapping in which every member is admitted beside the others."""
        empty, visited, now = self.score(()), dict[tuple[int, ...], ScoredSet](), best
        while True:
            while now.chosen not in visited:
                visited[now.chosen] = now
                now = self._move(now)
                self.report(f"effects in the set: {len(now.chosen)}, score {now.score - empty.score:.1f} nats")
            now = max(map(self._standing, visited.values()), key=lambda s: s.score)
            if now.chosen in visited:
                return now

    def _standing(self, found: ScoredSet) -> ScoredSet:
        """Return `found`, or that of its subsets with the highest score in which every member is admitted beside the others."""
        if self._stands(found):
            return found
        parts = [self.score(part) for n in range(len(found.chosen)) for part in combinations(found.chosen, n)]
        return next(scored for scored in sorted(parts, key=lambda scored: -scored.score) if self._stands(scored))

    def _stands(self, now: ScoredSet) -> bool:
        """Return whether every member of `now` is admitted beside the others."""
        return all(self.admits(self.score(now.without(k)), now) for k in now.chosen)

    def _move(self, now: ScoredSet) -> ScoredSet:
        """Return the set after one add, else one drop, else one swap; the set itself where none is better."""
        if len(now.chosen) < MOST_EFFECTS:
            more = self._better(now, [(*now.chosen, k) for k in self.screen(now.chosen)])
            if more is not now:
                return more
        for k in now.chosen:
            rest = self.score(now.without(k))
            if rest.score > now.score or not self.admits(rest, now):
                return rest
        for k in now.chosen:
            rest = self.score(now.without(k))
            better = self._better(now, [(*rest.chosen, other) for other in self.screen(rest.chosen)], rest)
            if better is not now:
                return better
        return now


@final
@dataclass(frozen=True, eq=False)
class GrownSearch:
    """A search whose library has grown, and the best set there."""

    search: Search
    best: ScoredSet
