"""The one place where a claim is decided: every candidate that came near gets a decision with its reason.

A member k of the best set S is claimed if it passes five tests. Whether the error on held-out recordings falls is judged last, of all
claims together (decision.withdrawal).

1. Gain: its gain exceeds LEAST_GAIN, the gain of chance in this campaign, and the gain that an error in the form of a larger claim l makes:
       gain(S less k, S) > max(LEAST_GAIN, q99 + o_k, max_l max(FORM, 1 - p_l)^2 gain_l)
   p_l: predictable share of l's torque (its card);  o_k: log prior odds of friction
   If the card of l lists k as a possible confusion, FORM gain_l is required, except of the standard terms of a joint. A law that takes as
   much from the unknown as l, and leaves FORM of it at most, is exempt from both. A member without which other claims fail is one
   explanation with them: it need only be more probable than not, and all of them together gain LEAST_GAIN each.
2. Values: one differs from 0 by PRECISE standard deviations, the interval of one that is reported excludes 0, and none lies beyond a
   physical bound. A law that differs between recordings must gain more than mass, drag and added mass fitted to each recording alone.
   Of a wave, no other frequency explains more than LEAVES as much (decision.other_frequencies).
3. Size: it moves the torque by RELEVANT of its rms, or explains FORM of the energy of what remains without it. In a part of the campaign
   it also moves FORM of the largest claim, whose error of form may show there.
4. Catalogue: it is more probable than a similar cause outside the catalogue (decision.catalogue_probability).
5. Possible: where most of the torque is that of drag or added mass beyond their bounds, these explain less, by LEAST_GAIN.

Members that fail leave the set, a special law for a plainer one of its cause, one with a value beyond a bound for a narrower form of
itself, and the others are judged again: first the one least probably in the catalogue, then the one that gains least. One dismissed as the
form of another leaves last, and is judged again when that other fails. The set with the higher score is claimed where a member that fails
could also stay: without those that share what it explains, in the place of one of them, or because claims fall with it. So a member that
gains little beside others is judged again without those of them that fail.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from nnhydro.diagnosis.constants import FORM, LEAST_GAIN, LEAVES, PRECISE
from nnhydro.diagnosis.decision.alternative_laws import with_narrower_form, with_plainer_law
from nnhydro.diagnosis.decision.catalogue_probability import listed_probability
from nnhydro.diagnosis.decision.form_error import form_bars
from nnhydro.diagnosis.decision.null_draws import least_gain, null_threshold
from nnhydro.diagnosis.decision.other_frequencies import share_elsewhere
from nnhydro.diagnosis.decision.parameters_per_recording import nats_of_parameters_per_recording
from nnhydro.diagnosis.problem.design import relevant_share
from nnhydro.diagnosis.problem.impossible_coefficients import impossible_coefficients
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.values import says_nothing, values_of

Array = NDArray[np.float64]
Shares = dict[int, float]
Known = dict[tuple[tuple[int, ...], frozenset[int], frozenset[int], frozenset[int]], "Claims"]
LEAST_PROBABLE = 0.5  # probability of a name; below it a cause outside the catalogue is more probable
EXPLAINED = "a claimed effect explains what it does, and more"
BEYOND = "a value lies beyond its physical bound"
IMPOSSIBLE = "coefficients beyond their physical bounds explain as much: check the lengths, diameters and density of arm.yaml"
IMPROBABLE = "a cause outside the catalogue is more probable: much remains, or the size differs between recordings"


@final
@dataclass(frozen=True)
class Decision:
    """One candidate, the statistic against its threshold, and why it is claimed or not; `small` is withdrawn for its size alone."""

    effect: str
    joint: int
    statistic: float
    threshold: float
    claimed: bool
    reason: str
    small: bool = False

    def document(self) -> dict[str, Any]:
        """Return the decision for diagnosis.json."""
        return {"effect": self.effect, "joint": self.joint or None, "statistic": round(self.statistic, 3),
                "threshold": round(self.threshold, 3), "claimed": self.claimed, "reason": self.reason}


@final
@dataclass(frozen=True, eq=False)
class Claims:
    """The claimed set, all decisions, each member's share of the torque, and the members removed as the form of others."""

    claimed: ScoredSet
    decisions: tuple[Decision, ...]
    shares: Shares
    as_form: frozenset[int] = frozenset()


def torque_shares(search: Search, found: ScoredSet) -> Shares:
    """Return the rms of each member's torque over the torque's rms, at the joint where it is largest."""
    view = search.view
    whitened, design = view.whitened, view.library.design
    shares = {}
    for k, at in found.places(view).items():
        u = view.columns(k).Xw @ found.fit.mean[at]
        torque = np.sqrt(((u / whitened.sw) ** 2).sum(axis=0) / design.duration)
        shares[k] = float((torque / np.maximum(design.scale, 1e-300)).max())
    return shares


def _precision(search: Search, found: ScoredSet, k: int) -> float:
    """The largest of a member's values over its standard deviation, the change beside the unknown included."""
    values = values_of(search, found, k)
    return float(np.abs(values.mean / np.sqrt(np.maximum(np.diag(values.covariance), 1e-300))).max())


def decide(search: Search, best: ScoredSet, seed: int, as_form: frozenset[int] = frozenset(), exact: frozenset[int] = frozenset(),
           known: Known | None = None, needed: frozenset[int] = frozenset()) -> Claims:
    """Return what of `best` is claimed, and a decision for each candidate.

    The members `as_form` left as the form of others; the members `exact` are the form of none; other claims fail without the members
    `needed`. `known` holds the sets judged so far.
    """
    known = {} if known is None else known
    place = best.chosen, as_form, exact, needed
    if place in known:
        return known[place]
    if not best.chosen:
        return Claims(best, (), {}, as_form)
    rests = {k: search.score(best.without(k)) for k in best.chosen}
    shares = torque_shares(search, best)
    largest = max(null_threshold(search, rest, seed) for rest in rests.values())
    chance = {k: 0.0 if k in needed else least_gain(search.view.library, largest, k) for k in best.chosen}
    bars = [0.0 if k in exact else bar for k, bar in zip(best.chosen, form_bars(search, best, list(rests.values())), strict=True)]
    judged = {k: _judge(search, best, rests[k], k, shares, max(chance[k], bar)) for k, bar in zip(best.chosen, bars, strict=True)}
    failed = [(chance[k] < gain <= bar, min(listed_probability(search, best, k), LEAST_PROBABLE), gain, k)
              for k, bar in zip(best.chosen, bars, strict=True) if not judged[k].claimed for gain in (search.gain(rests[k], best),)]
    if not failed:
        known[place] = Claims(best, tuple(judged.values()), shares, as_form)
        return known[place]
    form, *_, worst = min(failed)
    if form:
        made = decide(search, rests[worst], seed, as_form | {worst}, exact, known, needed)
        rival = (best, exact | {worst}, needed) if _fallen(judged, made) else None
    else:
        plain = (with_narrower_form if judged[worst].reason == BEYOND else with_plainer_law)(search, best, worst)
        made = decide(search, search.score(sorted({*plain.chosen, *as_form})), seed, frozenset(), exact, known, needed)
        improbable, weak = judged[worst].reason == IMPROBABLE, search.gain(rests[worst], best) <= chance[worst]
        instead = _members_instead(search, best, worst, improbable, made) if improbable or weak else set()
        rival = (search.score(best.without(*instead)), exact, needed) if instead else None
        if weak and worst not in needed and _fallen(judged, made):
            rival = best, exact, needed | {worst}
    exchanged = _exchange(search, best, worst, made)
    for other_set in (rival, exchanged and (exchanged, exact, needed)):
        if not other_set:
            continue
        other = decide(search, other_set[0], seed, as_form, other_set[1], known, other_set[2])
        needs = LEAST_GAIN * max(len(other.claimed.chosen) - len(made.claimed.chosen), 0)
        made = other if worst in other.claimed.chosen and other.claimed.score > made.claimed.score + needs else made
    decided = {(decision.effect, decision.joint) for decision in made.decisions}
    left = [decision if k == worst else replace(decision, claimed=False, reason=EXPLAINED) for k, decision in judged.items()]
    more = tuple(decision for decision in left if (decision.effect, decision.joint) not in decided)
    known[place] = replace(made, decisions=(*more, *made.decisions))
    return known[place]


def _exchange(search: Search, best: ScoredSet, k: int, made: Claims) -> ScoredSet | None:
    """Return the claims `made` with the failed member `k` of `best` in the place of one of them, where that scores higher; else None.

    The set is smaller than `best`: one of the same size would be judged for ever.
    """
    if k in made.claimed.chosen:
        return None
    rests = [made.claimed.without(m) for m in made.claimed.chosen if len(made.claimed.chosen) < len(best.chosen)]
    sets = [search.score((*rest, k)) for rest in rests if search.place(k) not in search.occupied_places(rest)]
    found = max(sets, key=lambda s: s.score, default=made.claimed)
    return found if found.score > made.claimed.score else None


def _fallen(judged: dict[int, Decision], made: Claims) -> set[int]:
    """Return the members that are claimed as `judged`, but not among the claims `made` without the worst."""
    return {k for k, decision in judged.items() if decision.claimed} - {*made.claimed.chosen}


def _members_instead(search: Search, now: ScoredSet, k: int, improbable: bool, made: Claims) -> set[int]:
    """Return the members without which the failed member `k` is judged again. They gain more without it: they share what it explains.

    Of an `improbable` member, these are the members that gain less; of one that gains too little, those that fail in their turn: that
    are not among the claims `made` without it.
    """
    def gain(m: int, found: ScoredSet) -> float:
        """Return the gain of member `m` of a set."""
        return search.gain(search.score(found.without(m)), found)

    rest = search.score(now.without(k))
    sharing = {m for m in rest.chosen if gain(m, rest) > gain(m, now) + LEAST_GAIN}
    return {m for m in sharing if gain(m, now) < gain(k, now)} if improbable else sharing - {*made.claimed.chosen}


def _gain_over_any_coefficients(search: Search, rest: ScoredSet, now: ScoredSet) -> float:
    """Return the nats that `now` gains over `rest` with any drag and added mass, where the torque is mostly that of impossible ones.

        n log(|W r_rest|^2 / |W r_now|^2) / 2,     r_rest: least squares, r_now: the same within physical bounds, W: weights beside `rest`
    """
    library, weight = search.view.library, best_fit(search, rest).whitened.sw
    if not impossible_coefficients(library.design):
        return float("inf")

    def left_by(found: ScoredSet, bounds: Array) -> float:
        """Return what the columns of a set leave within the bounds (2, k) of their values."""
        fit = best_fit(search, found)
        scale = weight / fit.whitened.sw
        X, y = (fit.rows * scale[..., None]).reshape(weight.size, -1), (fit.whitened.y * scale).ravel()
        low, high = np.broadcast_to(bounds, (2, X.shape[1]))
        return float(np.sum((y - X @ lsq_linear(X, y, (low, high)).x) ** 2))

    prior = library.design.baseline.prior
    of_laws = [np.tile(library.bounds(k), search.view.columns(k).Xw.shape[2] // library.hypotheses[k].width) for k in now.chosen]
    possible = np.concatenate([[prior.lowest, prior.highest], *of_laws], axis=1)
    return weight.size / 2 * float(np.log(left_by(rest, np.array([[-np.inf], [np.inf]])) / left_by(now, possible)))


def _judge(search: Search, now: ScoredSet, rest: ScoredSet, k: int, shares: Shares, threshold: float) -> Decision:
    effect, joint = search.key(k)
    gain = search.gain(rest, now)
    others = [share for other, share in shares.items() if other != k and search.view.library.hypotheses[k].activity is not None]
    fit = best_fit(search, rest)
    relevant = relevant_share(search.view.library.design, (fit.residual / fit.whitened.sw) ** 2)
    least = max(relevant, FORM * max(others, default=0.0))

    def tests() -> Iterator[tuple[float, float, str]]:
        """Yield statistic, threshold and reason of each test; the first that fails is the last to be computed."""
        yield gain, threshold, f"gains {gain:.1f} nats in addition to the other effects ({threshold:.1f} needed)"
        yield shares[k] / least, 1.0, f"moves {100 * shares[k]:.2f} % of the torque ({100 * least:.2f} % needed)"
        precision = _precision(search, now, k)
        yield precision / PRECISE, 1.0, f"its values differ from 0 by {precision:.1f} standard deviations ({PRECISE:.0f} needed)"
        yield 0.0 if says_nothing(search, now, k) else 1.0, 0.5, "the 95 % interval of each of its values contains 0"
        yield 0.0 if values_of(search, now, k).bounded else 1.0, 0.5, BEYOND
        differs = search.view.library.hypotheses[k].differs_between_recordings
        most = nats_of_parameters_per_recording(search, rest) if differs else 0.0
        yield gain, most, f"mass, drag and added mass fitted to each recording alone would gain more, {most:.1f} nats"
        yield listed_probability(search, now, k), LEAST_PROBABLE, IMPROBABLE
        yield _gain_over_any_coefficients(search, rest, now), LEAST_GAIN, IMPOSSIBLE

    for statistic, needed, reason in tests():
        if statistic <= needed:
            return Decision(effect, joint, statistic, needed, False, reason)
    elsewhere = share_elsewhere(search, rest, k)
    if elsewhere > LEAVES:
        return Decision(effect, joint, elsewhere, LEAVES, False, f"no line: another frequency explains {100 * elsewhere:.0f} % as much")
    return Decision(effect, joint, gain, threshold, True, f"gains {gain:.1f} nats in addition to the other effects")
