"""Laws that could take a member's place: the plainer ones of its cause, dry friction for Stribeck's, and those of nearly its torque."""

import numpy as np

from nnhydro.diagnosis.constants import FORM, LEAST_GAIN
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.values import values_of
from nnhydro.fitting.linear.least_squares import ridge

EQUIVALENT_COSINE = 1 - 2 * FORM**2  # cosine of visible torques from which two effects are one: each may be off by FORM, oppositely


def parameter_count(search: Search, k: int) -> int:
    """Return how many values, nonlinear ones included, hypothesis `k` has."""
    h = search.view.library.hypotheses[k]
    return h.width + sum(1 for name in h.spans if any(getattr(h.effect, name)))


def signal_count(search: Search, k: int) -> int:
    """Return on how many signals hypothesis `k` depends."""
    return len(search.view.library.hypotheses[k].effect.signature.depends_on)


def with_narrower_form(search: Search, found: ScoredSet, k: int) -> ScoredSet:
    """Return `found` with a form of fewer columns of the same law in place of member `k`, else with a plainer law, or without it."""
    hypotheses, base = search.view.library.hypotheses, search.score(found.without(k))
    forms = [i for i, hypothesis in enumerate(hypotheses) if hypothesis.key == hypotheses[k].key
             and hypothesis.width < hypotheses[k].width and hypothesis.activity == hypotheses[k].activity]
    best = max((search.score((*base.chosen, i)) for i in search.most_gaining(base, forms)), key=lambda s: s.score, default=base)
    return best if best is not base and search.admits(base, best) else with_plainer_law(search, found, k)


def with_plainer_law(search: Search, found: ScoredSet, k: int) -> ScoredSet:
    """Return `found` with a plainer law of the same cause in place of member `k`, or without it where none is admitted.

    Of plainer laws that of the fewest signals: a friction that falls with speed contains the dry one, not that of the load.
    """
    hypotheses = search.view.library.hypotheses
    base = search.score(found.without(k))
    plainer = [i for i, hypothesis in enumerate(hypotheses) if search.place(i) == search.place(k)
               and hypothesis.key != hypotheses[k].key and not hypothesis.effect.general
               and parameter_count(search, i) < parameter_count(search, k)]
    if not plainer:
        return base
    fewest = min(signal_count(search, i) for i in plainer)
    plainest = search.most_gaining(base, [i for i in plainer if signal_count(search, i) == fewest])
    best = max((search.score((*base.chosen, i)) for i in plainest), key=lambda s: s.score)
    return best if search.admits(base, best) else base


def replace_special_laws(search: Search, found: ScoredSet) -> ScoredSet:
    """Return `found` with special laws replaced by plainer ones of their cause where they take no more, or their values are those of it.

    A special law is admitted beside the plain one as any further effect is beside a set. One that gains too little to be claimed takes no
    other's place.
    """
    for k in found.chosen:
        plain, base = with_plainer_law(search, found, k), search.score(found.without(k))
        if search.gain(base, plain) <= LEAST_GAIN:
            continue
        special = found.score > plain.score + LEAST_GAIN and search.admits(plain, found) and _is_special(search, found, k)
        if not special:
            found = plain
    return found


def _is_special(search: Search, found: ScoredSet, k: int) -> bool:
    """Return whether the values of member `k` need its special law: Stribeck friction without a breakaway is dry friction."""
    h = search.view.library.hypotheses[k]
    return h.per_recording or h.plausible(values_of(search, found, k).mean)


def cosine_of_torques(search: Search, found: ScoredSet, k: int, there: ScoredSet, other: int) -> float:
    """Return the cosine between the torques of member `k` of `found` and member `other` of `there`, the baseline projected out."""
    whitened = search.view.whitened
    torques = []
    for scored, number in ((found, k), (there, other)):
        u = search.view.columns(number).Xw @ scored.fit.mean[scored.places(search.view)[number]]
        torques.append((u - whitened.Y @ ridge(whitened.Y.reshape(u.size, whitened.p), u.ravel())).ravel())
    a, b = torques
    return float(abs(a @ b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300))
