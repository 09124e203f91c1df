"""The naming part of a diagnosis: search, prune, leave out what is small or unsure, and the proof of what stays."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.case import Case
from nnhydro.diagnosis.detail import Asked, detailed
from nnhydro.diagnosis.instances import instances
from nnhydro.diagnosis.locks import P_BLOCK, P_LEFT_OUT, family_wise_p
from nnhydro.diagnosis.placebo import whiteness
from nnhydro.diagnosis.proof import Proof, prove
from nnhydro.diagnosis.race import UNPHYSICAL, Race, ranked
from nnhydro.diagnosis.relax import prune
from nnhydro.diagnosis.search import Found, search, with_loads
from nnhydro.diagnosis.starts import started
from nnhydro.diagnosis.steadfast import drop_made_by_filter
from nnhydro.diagnosis.tuned import drop_untuned
from nnhydro.diagnosis.verdict import Finding, findings, simplest
from nnhydro.recordings.splitting import Unit

COMPANION = 0.06  # of the improvement: what a further effect must add; less is mostly what an effect of slightly other form leaves
SCORE_SHARE = 0.15  # the same in left-out score, the cost of moving masses included
MOSTLY = 0.6  # of the excess over the noise: findings that explain less of it are trusted less, in proportion; 0.6 of it if no more is seen
KNOWN = 0.05  # of the noise's energy: how well it is known; what lies within is no excess that a finding would have to explain
SEEN = 10.0  # gain in left-out score that shows something, what is claimed and what is still to be found: chance gains some
CONFIDENT = 0.5  # nothing is said with less
COLOURED = 0.3  # of the lags: what remains is no noise where it is correlated at so many; noise is at 0.05


def torque_peaks(all_units: Iterable[Unit]) -> tuple[float, ...]:
    """Return the largest torque measured at each joint, N m."""
    peaks = [np.abs(segment.tau[segment.keep]).max(axis=0) for unit in all_units for segment in unit.segments()
             if segment.tau is not None and segment.keep.any()]
    return tuple(float(x) for x in np.max(peaks, axis=0))


@final
@dataclass(frozen=True, eq=False)
class Named:
    """What was found, the findings it is told in, and their proof on recordings left out."""

    found: Found
    findings: list[Finding]
    proof: Proof


def named(case: Case, repeats: tuple[float, ...] | None = None, seed: int = 0, without: Sequence[str] = (),
          progress: Callable[[str], None] = lambda line: None) -> Named:
    """Return what the baseline leaves out of `case`; `repeats` (joints,) N m is the noise seen in repeats, `without` ids not to try."""
    known = started(case, instances(case.model.arm, torque_peaks(case.all_units), without))
    found = search(case, known, repeats, seed, progress)
    race = detailed(Asked(found.table, found.believed, repeats), found.race)
    if race is not found.race:
        found = replace(found, race=race, believed=with_loads(case, race, race.chosen))
    drop_untuned(race, found.table, found.believed, known)
    prune(race, found.table, found.believed)
    drop_made_by_filter(case, race, found.believed)
    race.chosen = simplest(race)
    drop_impossible(race)
    drop_leftovers(race, seed)
    coloured = False
    while True:
        said = sure(race, seed, coloured)
        proof = prove(race, found.table, found.believed)
        if (least := _least(race, proof) if len(race.chosen) > 1 else None) is not None:
            race.chosen.remove(least)
        elif race.chosen and not coloured and is_coloured(proof):
            coloured = True
        else:
            return Named(found, said, proof)


def is_coloured(proof: Proof) -> bool:
    """Return whether what remains at some joint is correlated in time far more than noise is."""
    joints = proof.remains[0].r.shape[1] if proof.remains else 0
    return any(whiteness(proof.remains, joint) >= COLOURED for joint in range(joints))


def sure(race: Race, seed: int = 0, coloured: bool = False) -> list[Finding]:
    """Return the findings after taking away, until nothing changes, what is impossible, faint, or said with a confidence below one half."""
    while True:
        drop_faint(race)
        said = trusted(race, seed, coloured)
        kept = [f.candidate for f in said if f.confidence >= CONFIDENT]
        if len(kept) == len(race.chosen):
            return said
        race.chosen = kept


def trusted(race: Race, seed: int = 0, coloured: bool = False) -> list[Finding]:
    """Return the findings with their confidence, less where together they explain little, sooner where something else is seen, too.

        trust = min(1, s / 0.6),   min(1, s) where something more is seen,   min(1, s, (1/2 + s)/2) where it is sure, or coloured
        s = explained / (0.6 f)

    What they leave may be the cause of all. How much is expected of them, f, the card of the strongest says (`Effect.foreseen`).
    """
    if not race.chosen:
        return []
    strongest = max(race.chosen, key=race.loss)
    share = explained(race) / (MOSTLY * strongest.instance.effect.foreseen)
    trust = min(1.0, *(share / MOSTLY, share, (CONFIDENT + share) / 2)[: 1 + (2 if coloured else more_to_see(race, seed))])
    return [replace(f, confidence=trust * f.confidence) for f in findings(race)]


def drop_impossible(race: Race) -> None:
    """Take away, the weakest first, what others made possible that have been taken away: a value now leaves its physical bounds."""
    while race.chosen and race.total() >= UNPHYSICAL:
        race.chosen.remove(min(race.chosen, key=race.loss))


def drop_faint(race: Race) -> None:
    """Take away, the weakest first, what gains less in left-out score than shows anything, and what is impossible without it."""
    drop_impossible(race)
    while race.chosen and race.loss(least := min(race.chosen, key=race.loss)) < SEEN:
        race.chosen.remove(least)
        drop_impossible(race)


def drop_leftovers(race: Race, seed: int) -> None:
    """Take away what may be made of the part of another finding that nobody can foretell, where without it much remains unexplained.

    Of a finding with the gain g, of which the share f is foreseen, what gains less than (1 - f) g is not claimed, and less than
    (1 - f) g / f where it is what the finding is mistaken for: a gap turns late, and a delay shaves that. What is akin to the finding
    (`Effect.akin`) is not claimed however much is explained: flanks that give are half a compliance.
    """
    if not race.chosen or not more_to_see(race, seed):
        return
    gain = {c.key: race.loss(c) for c in race.chosen}

    def makes(other: Candidate, c: Candidate) -> bool:
        f, mistaken = other.instance.effect.foreseen, _mistaken_for(other, c)
        return other is not c and gain[c.key] < gain[other.key] * (1 - f) / (f if mistaken else 1.0)

    def leftover(c: Candidate) -> bool:
        makers = [other for other in race.chosen if makes(other, c)]
        return any(_akin(o, c) for o in makers) or (bool(makers) and explained(race, [c]) < MOSTLY)

    race.chosen = [c for c in race.chosen if not leftover(c)]


def _mistaken_for(one: Candidate, other: Candidate) -> bool:
    return other.key[0] in one.instance.effect.signature.mistaken_for


def _akin(one: Candidate, other: Candidate) -> bool:
    """Whether `other` is largely the torque of `one` in another form, at the same joint."""
    return other.key[0] in one.instance.effect.akin and one.key[1] == other.key[1]


def more_to_see(race: Race, seed: int) -> int:
    """Return whether a test or any effect of the bank still sees something beside what is chosen: 0, 1, or 2 where the test is sure."""
    p = family_wise_p(race, seed)
    if p <= P_BLOCK:
        return 2
    more = max((gain for gain, _ in ranked(race, race.bank.candidates)), default=0.0)
    return int(more > SEEN or p <= P_LEFT_OUT)


def explained(race: Race, without: Sequence[Candidate] = ()) -> float:
    """Return the share of the baseline's excess over the noise, in left-out score, that the chosen effects, less `without`, take away."""
    whole = race.scored(without=race.chosen).total
    gain, rows = whole - race.scored(without=without).total, float(race.bench.blocks.n.sum()) * len(race.noise)
    return gain / max(whole - KNOWN * rows / 2, gain, 1.0)


def _least(race: Race, proof: Proof) -> Candidate | None:
    """The finding that adds least, where it adds less than its share: shape left by another.

    What it adds counts on left-out recordings and in the score, which knows what it costs to move masses instead.
    """
    gain = {c.key: proof.without[c.key] - proof.after for c in race.chosen}
    score = {c.key: race.loss(c) for c in race.chosen}
    whole = race.scored(without=race.chosen).total - race.scored().total
    small = [c for c in race.chosen if gain[c.key] < COMPANION * (proof.before - proof.after) and score[c.key] < SCORE_SHARE * whole]
    return min(small, key=lambda c: gain[c.key], default=None)
