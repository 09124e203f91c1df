"""The one place where a claim is decided: every candidate that came near gets a decision with its reason.

A member k of the best set S is claimed if it passes six tests.

1. Gain: its gain exceeds LEAST_GAIN, the gain of chance in this campaign, and the gain that an error in the form of a larger claim l makes:
       gain(S less k, S) > max(LEAST_GAIN, q99, max_l max(FORM, 1 - p_l)^2 gain_l),      p_l: predictable share of l's torque (its card)
   If the card of l lists k as a possible confusion, FORM gain_l is asked, except of the standard terms of a joint. A law that takes as much
   from the unknown as l, and leaves FORM of it at most, is exempt from both.
2. Unknown: the law replaces the unknown as a true law does (search.stepwise.admits).
3. Prediction: held-out recordings are predicted better. Without the recording that supports the law most, they are predicted worse by
   FORM of the gain at most: where many recordings show the same, the unknown predicts the others as well as a law.
4. Values: one differs from 0 by PRECISE standard deviations, the interval of one that is reported excludes 0, and none lies beyond a
   physical bound. A law that differs between recordings must gain more than mass, drag and added mass fitted to each recording alone.
   Of a wave, no other frequency explains more than LEAVES as much (decision.other_frequencies).
5. Size: it moves the torque by RELEVANT of its rms, or explains FORM of the energy of what remains without it. In a part of the campaign
   it also moves FORM of the largest claim, whose error of form may show there.
6. Catalogue: it is more probable than a similar cause outside the catalogue (decision.catalogue_probability).

Members that fail leave the set, and the others are judged again: first the one least probably in the catalogue, then the one that gains
least. A member dismissed as the form of another leaves last, and is judged again when that other fails.
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from nnhydro.diagnosis.constants import FORM, LEAST_GAIN, LEAVES, P_ALARM, PRECISE, RELEVANT
from nnhydro.diagnosis.decision.catalogue_probability import listed_probability
from nnhydro.diagnosis.decision.heldout import log_densities
from nnhydro.diagnosis.decision.heldout_errors import Proof, fitted_error, prove
from nnhydro.diagnosis.decision.null_draws import null_threshold
from nnhydro.diagnosis.decision.other_frequencies import share_elsewhere
from nnhydro.diagnosis.decision.parameters_per_recording import nats_of_parameters_per_recording
from nnhydro.diagnosis.problem.design import relevant_share
from nnhydro.diagnosis.problem.hypothesis import AnyEffect
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.values import says_nothing, values_of
from nnhydro.models.strip_theory import StripTheory
from nnhydro.sheet import percent

Array = NDArray[np.float64]
LEAST_PROBABLE = 0.5  # of a name: below it a cause on no card is more probable


@final
@dataclass(frozen=True)
class Decision:
    """One candidate, the statistic against its threshold, and why it is claimed or not."""

    effect: str
    joint: int
    statistic: float
    threshold: float
    claimed: bool
    reason: str

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
    shares: dict[int, float]
    as_form: frozenset[int] = frozenset()


def torque_shares(search: Search, found: ScoredSet) -> dict[int, float]:
    """Return the rms of each member's torque over the torque's rms, at the joint where it is largest."""
    view = search.view
    whitened, design = view.whitened, view.library.design
    shares = {}
    for k, at in found.places(view).items():
        u = view.columns(k).Xw @ found.fit.mean[at]
        torque = np.sqrt(((u / whitened.sw) ** 2).sum(axis=0) / design.time)
        shares[k] = float((torque / np.maximum(design.scale, 1e-300)).max())
    return shares


def _precision(search: Search, found: ScoredSet, k: int) -> float:
    """The largest of a member's values over its standard deviation, the change beside the unknown included."""
    values = values_of(search, found, k)
    return float(np.abs(values.mean / np.sqrt(np.maximum(np.diag(values.covariance), 1e-300))).max())


def decide(search: Search, best: ScoredSet, seed: int) -> Claims:
    """Return what of `best` is claimed, and a decision for each candidate."""
    decisions: dict[int, Decision] = {}
    now, as_form = best, frozenset[int]()
    while now.chosen:
        rests = {k: _without(search, now, {k}) for k in now.chosen}
        densities = log_densities(search.view, [now, *rests.values()], seed)
        by_fold = densities[:, :1] - densities[:, 1:]  # (folds, members)
        shares = torque_shares(search, now)
        chance = max(LEAST_GAIN, max(null_threshold(search, rest, seed) for rest in rests.values()))
        bars = _form_bars(search, now, list(rests.values()))
        judged = {k: _judge(search, now, rests[k], k, by_fold[:, i], shares, max(chance, bars[i])) for i, k in enumerate(now.chosen)}
        failed = [(chance < gain <= bar, min(listed_probability(search, now, k), LEAST_PROBABLE), gain, k)
                  for k, bar in zip(now.chosen, bars, strict=True) if not judged[k].claimed for gain in (search.gain(rests[k], now),)]
        if not failed:
            return Claims(now, (*(d for k, d in decisions.items() if k not in judged), *judged.values()), shares, as_form)
        form, *_, worst = min(failed)
        decisions = {k: d for k, d in decisions.items() if k != worst} | {worst: judged[worst]}
        now = rests[worst] if form else search.score(sorted({*rests[worst].chosen, *as_form}))
        as_form = as_form | {worst} if form else frozenset()
    return Claims(now, tuple(decisions.values()), {}, as_form)


def _without(search: Search, found: ScoredSet, members: Set[int]) -> ScoredSet:
    return search.score(tuple(k for k in found.chosen if k not in members))


def _form_bars(search: Search, now: ScoredSet, rests: Sequence[ScoredSet]) -> list[float]:
    """Return the gain of each member that an error in the form of another member could explain.

    It is FORM^2 of the other's gain, or FORM of it if a card names one as a possible confusion of the other. If the other can be predicted
    in part only, its unpredictable share takes the place of FORM. A member is exempt if it takes more than this share from the unknown, and
    leaves at most FORM: an error of form is not exactly another law.
    """
    gains = [search.gain(rest, now) for rest in rests]
    before = [search.nats_of_unknown(rest, [k]) for k, rest in zip(now.chosen, rests, strict=True)]
    after = [search.nats_of_unknown(now, [k]) for k in now.chosen]
    explained = [gain + more - less for gain, more, less in zip(gains, before, after, strict=True)]
    effects = [search.view.library.hypotheses[k].effect for k in now.chosen]
    exactly = [less <= FORM * more and whole > bar
               for less, more, whole, bar in zip(after, before, explained, _shares_of_form(effects, explained), strict=True)]
    return [0.0 if exact else bar for exact, bar in zip(exactly, _shares_of_form(effects, gains), strict=True)]


def _shares_of_form(effects: Sequence[AnyEffect], nats: Sequence[float]) -> list[float]:
    """Return how much of each member's `nats` the form of the others could be."""
    bars = []
    for i, effect in enumerate(effects):
        alike = [nats[j] for j, other in enumerate(effects) if j != i and nats[j] > nats[i] and not effect.standard
                 and (other.id in effect.signature.mistaken_for or effect.id in other.signature.mistaken_for)]
        missed = [max(FORM, 1 - other.predictable_share) ** 2 * nats[j] for j, other in enumerate(effects) if j != i]
        bars.append(max(*missed, FORM**2 * nats[i], FORM * max(alike, default=0.0)))
    return bars


def gain_on_unseen(by_fold: Array) -> float:
    """Return the nats that the folds `by_fold` (folds,) gain without the best one, which may lose FORM of the whole gain.

        sum_f g_f - max_f g_f + FORM sum_f g_f         where the sum is positive, the sum else
    """
    total = float(by_fold.sum())
    return total - float(by_fold.max()) + FORM * total if len(by_fold) > 2 and total > 0 else total


def _judge(search: Search, now: ScoredSet, rest: ScoredSet, k: int, by_fold: Array, shares: dict[int, float], threshold: float) -> Decision:
    effect, joint = search.key(k)
    gain = search.gain(rest, now)
    others = [share for other, share in shares.items() if other != k and search.view.library.hypotheses[k].activity is not None]
    fit = best_fit(search, rest)
    relevant = relevant_share(search.view.library.design, (fit.residual / fit.whitened.sw) ** 2)
    least = max(relevant, FORM * max(others, default=0.0))
    precision = _precision(search, now, k)
    on_unseen = gain_on_unseen(by_fold)
    per_recording = nats_of_parameters_per_recording(search, rest) if search.view.library.hypotheses[k].differs_between_recordings else 0.0
    tests = (
        (gain, threshold, f"gains {gain:.1f} nats in addition to the other effects ({threshold:.1f} needed)"),
        (shares[k] / least, 1.0, f"moves {100 * shares[k]:.2f} % of the torque ({100 * least:.2f} % needed)"),
        (precision / PRECISE, 1.0, f"its values differ from 0 by {precision:.1f} standard deviations ({PRECISE:.0f} needed)"),
        (0.0 if says_nothing(search, now, k) else 1.0, 0.5, "the 95 % interval of each of its values contains 0"),
        (0.0 if values_of(search, now, k).bounded else 1.0, 0.5, "a value lies beyond its physical bound"),
        (gain, per_recording, f"mass, drag and added mass fitted to each recording alone would gain more, {per_recording:.1f} nats"),
        (on_unseen, 0.0, "the prediction of held-out recordings does not improve"),
        (listed_probability(search, now, k), LEAST_PROBABLE, "a cause outside the catalogue is more probable: much "
                                                             "remains, or the size differs between recordings"),
        (1.0 if search.admits(rest, now) else 0.0, 0.5, "a smooth unknown law explains the residual as well"),
    )
    for statistic, needed, reason in tests:
        if statistic <= needed:
            return Decision(effect, joint, statistic, needed, False, reason)
    elsewhere = share_elsewhere(search, rest, k)
    if elsewhere > LEAVES:
        return Decision(effect, joint, elsewhere, LEAVES, False, f"no line: another frequency explains {100 * elsewhere:.0f} % as much")
    return Decision(effect, joint, gain, threshold, True, f"gains {gain:.1f} nats, and improves the prediction of held-out recordings")


def _exempt_members(search: Search, claimed: ScoredSet, proof: Proof) -> set[int]:
    """Return the members of the set that are claimed whatever the error on held-out recordings.

    One kind: only with them the fitted baseline agrees with arm.yaml, |z| <= Phi^-1(1 - P_ALARM / 2). Calibration would hide a payload in
    the masses of a link, for example. The other kind cannot be predicted (`_is_unpredictable`), and lowers the error of the fit enough: by
    FORM if its phase differs between recordings, else to the share of its energy that its card calls unpredictable.
    """
    most = -float(ndtri(P_ALARM / 2))

    def contradicts_arm(found: ScoredSet) -> bool:
        """Return whether the baseline, fitted beside a set, contradicts arm.yaml."""
        return float(np.abs(best_fit(search, found).z).max(initial=0.0)) > most

    def largest_ratio(k: int) -> float:
        """Return the largest ratio of the errors with and without member `k` at which it is claimed."""
        h = search.view.library.hypotheses[k]
        return 1 - FORM if h.per_recording else float(np.sqrt(1 - h.effect.predictable_share))

    rests = {k: _without(search, claimed, {k}) for k in claimed.chosen}
    unpredicted = {k for k, rest in rests.items() if _is_unpredictable(search, k)
                   and fitted_error(search, claimed, proof) < largest_ratio(k) * fitted_error(search, rest, proof)}
    return unpredicted | {k for k, rest in rests.items() if not contradicts_arm(claimed) and contradicts_arm(rest)}


def _is_unpredictable(search: Search, k: int) -> bool:
    """Return whether the torque of member `k` cannot be predicted: it depends on a phase, or on the smallest torques."""
    h = search.view.library.hypotheses[k]
    return h.per_recording or h.effect.predictable_share < 1


def _prove_what_is_predicted(search: Search, claimed: ScoredSet, model: StripTheory, seed: int) -> Proof:
    """Return the proof of the set; members that cannot be predicted take part only if they lower the error."""
    proof = prove(search, claimed, model, seed)
    idle = {k for k in claimed.chosen if _is_unpredictable(search, k) and proof.without[search.key(k)] <= proof.after}
    if not idle:
        return proof
    rest = _prove_what_is_predicted(search, _without(search, claimed, idle), model, seed)
    return replace(rest, without=rest.without | {search.key(k): rest.after for k in idle})


def withdraw_useless(search: Search, decided: Claims, model: StripTheory, seed: int) -> tuple[Claims, Proof]:
    """Return the claims that lower the error on held-out recordings, the worst withdrawn first, and the errors with them.

    A claim is withdrawn if it does not lower this error enough (`_falls_enough`): first the one without which the error is lowest, then the
    next. If the error does not fall enough with all that remain, all are withdrawn. `_exempt_members` stay. After each withdrawal, the
    others are judged again.
    """
    while True:
        proof = _prove_what_is_predicted(search, decided.claimed, model, seed)
        exempt = _exempt_members(search, decided.claimed, proof)
        without = {k: proof.without[search.key(k)] for k in decided.claimed.chosen if k not in exempt}
        worst = min(without, key=lambda k: without[k], default=None)
        if worst is None:
            return decided, proof
        burden = not _falls_enough(without[worst], proof.after)
        if not burden and _falls_enough(proof.before, proof.after):
            return decided, proof
        reason = (f"the error on held-out {proof.held_out} hardly falls when it is added, from "
                  f"{percent(without[worst] if burden else proof.before)} to {percent(proof.after)}")
        decided = _withdraw(search, decided, {worst} if burden else set(without), reason, seed)


def _falls_enough(before: float, after: float) -> bool:
    """Return whether an error falls by the share RELEVANT, and by as much as the least torque that a claim must move.

        before - after >= RELEVANT before,        sqrt(before^2 - after^2) >= min(RELEVANT, sqrt(FORM) before)
    """
    least = min(RELEVANT, float(np.sqrt(FORM)) * before)
    return before - after >= RELEVANT * before and before**2 - after**2 >= least**2


def _withdraw(search: Search, decided: Claims, gone: Set[int], reason: str, seed: int) -> Claims:
    """Return the claims without `gone`; the others, and members removed as the form of a claim, are judged again."""
    keys = set(map(search.key, gone))
    decisions = tuple(replace(decision, claimed=False, reason=reason) if decision.claimed and (decision.effect, decision.joint) in keys
                      else decision for decision in decided.decisions)
    rest = {*decided.claimed.chosen, *decided.as_form} - gone
    again = decide(search, search.score(sorted(rest)), seed)
    judged = {(decision.effect, decision.joint) for decision in again.decisions}
    others = [decision for decision in decisions if (decision.effect, decision.joint) not in judged]
    return replace(again, decisions=(*others, *again.decisions))
