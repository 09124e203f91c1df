"""Claims that do not lower the error on held-out recordings enough are withdrawn."""

from collections.abc import Set
from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from nnhydro.diagnosis.constants import FORM, P_ALARM, RELEVANT
from nnhydro.diagnosis.decision.decide import Claims, decide
from nnhydro.diagnosis.decision.heldout_errors import HeldoutErrors, fitted_error, measure_errors
from nnhydro.diagnosis.decision.parameters_per_recording import nats_of_parameters_per_recording
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.models.strip_theory import StripTheory
from nnhydro.sheet import percent


def contradicts_arm(search: Search, found: ScoredSet) -> bool:
    """Return whether the baseline, fitted beside a set, contradicts arm.yaml: |z| > Phi^-1(1 - P_ALARM / 2)."""
    return float(np.abs(best_fit(search, found).z).max(initial=0.0)) > -float(ndtri(P_ALARM / 2))


def _exempt_members(search: Search, claimed: ScoredSet, heldout: HeldoutErrors) -> set[int]:
    """Return the members of the set that are claimed whatever the error on held-out recordings.

    One kind: only with them the fitted baseline agrees with arm.yaml (`contradicts_arm`). Calibration would hide a payload in
    the masses of a link, for example. Where masses differ between recordings, their mean is no evidence. The other kind cannot be
    predicted (`_is_unpredictable`), and lowers the error of the fit enough: by FORM if its phase differs between recordings, else to the
    share of its energy that its card calls unpredictable.
    """
    def largest_ratio(k: int) -> float:
        """Return the largest ratio of the errors with and without member `k` at which it is claimed."""
        h = search.view.library.hypotheses[k]
        return 1 - FORM if h.per_recording else float(np.sqrt(1 - h.effect.predictable_share))

    rests = {k: search.score(claimed.without(k)) for k in claimed.chosen}
    unpredicted = {k for k, rest in rests.items() if _is_unpredictable(search, k)
                   and fitted_error(search, claimed, heldout) < largest_ratio(k) * fitted_error(search, rest, heldout)}
    needed = {k for k, rest in rests.items() if not contradicts_arm(search, claimed) and contradicts_arm(search, rest)}
    return unpredicted | {k for k in needed if nats_of_parameters_per_recording(search, rests[k]) < search.gain(rests[k], claimed)}


def _is_unpredictable(search: Search, k: int) -> bool:
    """Return whether the torque of member `k` cannot be predicted: it depends on a phase, or on the smallest torques."""
    h = search.view.library.hypotheses[k]
    return h.per_recording or h.effect.predictable_share < 1


def _errors_of_predictable(search: Search, claimed: ScoredSet, model: StripTheory, seed: int) -> HeldoutErrors:
    """Return the held-out errors of the set; members that cannot be predicted take part only if they lower the error."""
    heldout = measure_errors(search, claimed, model, seed)
    idle = {k for k in claimed.chosen if _is_unpredictable(search, k) and heldout.without[search.key(k)] <= heldout.after}
    if not idle:
        return heldout
    rest = _errors_of_predictable(search, search.score(claimed.without(*idle)), model, seed)
    return replace(rest, without=rest.without | {search.key(k): rest.after for k in idle})


def withdraw_useless(search: Search, decided: Claims, model: StripTheory, seed: int) -> tuple[Claims, HeldoutErrors]:
    """Return the claims that lower the error on held-out recordings, the worst withdrawn first, and the errors with them.

    A claim is withdrawn if it does not lower this error enough (`_falls_enough`): first the one without which the error is lowest, then the
    next. If the error does not fall enough with all that remain, all are withdrawn. `_exempt_members` stay. After each withdrawal, the
    others are judged again.
    """
    while True:
        heldout = _errors_of_predictable(search, decided.claimed, model, seed)
        exempt = _exempt_members(search, decided.claimed, heldout)
        without = {k: heldout.without[search.key(k)] for k in decided.claimed.chosen if k not in exempt}
        worst = min(without, key=lambda k: without[k], default=None)
        if worst is None:
            return decided, heldout
        burden = not _falls_enough(without[worst], heldout.after)
        if not burden and _falls_enough(heldout.before, heldout.after):
            return decided, heldout
        before = without[worst] if burden else heldout.before
        reason = f"the error on held-out {heldout.unit} hardly falls when it is added, from {percent(before)} to {percent(heldout.after)}"
        decided = _withdraw(search, decided, {worst} if burden else set(without), reason, seed, small=before > heldout.after)


def _falls_enough(before: float, after: float) -> bool:
    """Return whether an error falls by the share RELEVANT, and by as much as the least torque that a claim must move.

        before - after >= RELEVANT before,        sqrt(before^2 - after^2) >= min(RELEVANT, sqrt(FORM) before)
    """
    least = min(RELEVANT, float(np.sqrt(FORM)) * before)
    return before - after >= RELEVANT * before and before**2 - after**2 >= least**2


def _withdraw(search: Search, decided: Claims, gone: Set[int], reason: str, seed: int, *, small: bool) -> Claims:
    """Return the claims without `gone`; the others, and members removed as the form of a claim, are judged again."""
    keys = set(map(search.key, gone))
    withdrawn = {decision for decision in decided.decisions if decision.claimed and (decision.effect, decision.joint) in keys}
    decisions = tuple(replace(decision, claimed=False, reason=reason, small=small) if decision in withdrawn else decision
                      for decision in decided.decisions)
    rest = {*decided.claimed.chosen, *decided.as_form} - gone
    again = decide(search, search.score(sorted(rest)), seed)
    judged = {(decision.effect, decision.joint) for decision in again.decisions}
    others = [decision for decision in decisions if (decision.effect, decision.joint) not in judged]
    return replace(again, decisions=(*others, *again.decisions))
