"""The probability that a claimed effect is the cause, and not a similar cause outside the catalogue.

    P = LISTED / (1 + (left / L)^4 + (scatter / TRUSTED_RATIO)^4),    L = FORM, of a standard term of a joint TRUSTED_RATIO

A law that is the cause leaves almost nothing to the unknown, and has one size in all recordings. A similar law leaves a share, or its size
differs with the motion: `scatter` is its relative deviation between recordings beyond their noise. It is 0 of what varies on a
sound machine: friction with its temperature, offsets, a current.

Of an effect with a low prior probability, `left` is the share of the nats to explain that the whole unknown keeps, as in search.stepwise.
A standard term of a joint is probable beforehand, whatever else acts. Only its form is tested: how much better does any function of its
variable explain the torque of the joint?

    left = n(S) / n(S less the laws of this variable),    n: nats that a smooth function of the variable gains beside a set

A constant may be the mean of a function of the angle, as of a cable that pulls to one side. No smooth function holds it: its denominator
is n(S) + g, with g the nats that it gains in S without the unknown. A viscous friction in place of a dry one leaves half; dry friction of
a real drive a tenth. Below `FEW_NATS` nothing is left. Where a few
recordings cannot distinguish the two, both are reported, and the form of the better one counts.
"""

import numpy as np

from nnhydro.diagnosis.constants import FEW_NATS, FORM, LEAST_GAIN, SMALLEST_SIZE, TRUSTED_RATIO, UNLISTED
from nnhydro.diagnosis.decision.scatter import scatter_between_parts, scatter_between_recordings
from nnhydro.diagnosis.model.sizes import Sizes, fit_sizes, without_unknown
from nnhydro.diagnosis.search.scored_set import LARGE_START, SMALL_START, ScoredSet
from nnhydro.diagnosis.search.stepwise import Search

NAMED_WRONGLY = 1 / 6  # share of the machines that hide an unlisted cause which get a name
LISTED = (1 - UNLISTED) / (1 - UNLISTED + UNLISTED * NAMED_WRONGLY)  # 0.96: share of names that are right
CONSTANT = ("nothing",)
VARIABLES: dict[tuple[str, ...], str] = {CONSTANT: "q{}_rad", ("q",): "q{}_rad", ("qd",): "dq{}_rad_s", ("qdd",): "ddq{}_rad_s2"}


def listed_probability(search: Search, found: ScoredSet, k: int) -> float:
    """Return the probability that member `k` of `found` is the cause itself, given that some cause like it is there."""
    if search.view.library.hypotheses[k].effect.standard:
        left = _share_left_of_class(search, found, k) / TRUSTED_RATIO
    else:
        left = search.share_left(search.score(found.without(k)), found) / FORM
    between = 0.0 if search.view.library.hypotheses[k].effect.varies else scatter_between_recordings(search, found, k)
    scatter = max(between, scatter_between_parts(search, found, k))
    return LISTED / (1.0 + max(left, 0.0) ** 4 + (scatter / TRUSTED_RATIO) ** 4)


def _share_left_of_class(search: Search, found: ScoredSet, k: int) -> float:
    """Return the share left by member `k`, or by an equally probable standard term of its variable if that leaves less."""
    hypotheses, effect = search.view.library.hypotheses, search.view.library.hypotheses[k].effect
    left = share_left_of_form(search, found, k)
    effects = [hypothesis.effect for hypothesis in hypotheses]
    among = [i for i, other in enumerate(effects) if other.standard and other.joint == effect.joint and other.id != effect.id
             and other.signature.depends_on == effect.signature.depends_on]
    rest = search.score(found.without(k))
    if not left or not among or {search.place(i) for i in among} & search.occupied_places(rest.chosen):
        return left
    for i in search.most_gaining(rest, among, 1):
        other = search.score((*rest.chosen, i))
        if other.score > found.score - LEAST_GAIN and search.admits(rest, other):
            left = min(left, share_left_of_form(search, other, i))
    return left


def share_left_of_form(search: Search, found: ScoredSet, k: int) -> float:
    """Return the share of what a function of the variable of member `k` explains that the laws of this variable leave to it."""
    hypotheses = search.view.library.hypotheses
    name = VARIABLES.get(hypotheses[k].effect.signature.depends_on)
    if name is None or name.format(search.key(k)[1]) not in search.whitened.unknown.names:
        return 0.0
    same_variable = {i for i in found.chosen if hypotheses[i].effect.signature.depends_on == hypotheses[k].effect.signature.depends_on
           and search.key(i)[1] == search.key(k)[1]}
    at = search.key(k)[1] - 1, search.whitened.unknown.names.index(name.format(search.key(k)[1]))
    after, rest = _nats_of_one_variable(search, found.chosen, at), tuple(x for x in found.chosen if x not in same_variable)
    if after <= FEW_NATS:
        return 0.0
    constant = hypotheses[k].effect.signature.depends_on == CONSTANT
    before = after + _gain(search, rest, found) if constant else _nats_of_one_variable(search, rest, at)
    return after / max(before, after)


def _gain(search: Search, rest: tuple[int, ...], found: ScoredSet) -> float:
    """Return the nats that a set gains beside a part of it, both without the unknown."""
    with_them, without = (scored.fit.log_evidence - scored.unknown_nats for scored in (found, search.score(rest)))
    return with_them - without


def _nats_of_one_variable(search: Search, chosen: tuple[int, ...], at: tuple[int, int]) -> float:
    """Return the nats that the unknown gains beside `chosen` as a function of one variable at one joint, `at`."""
    whitened, columns = search.whitened, search.view.join(chosen)
    gained = [0.0]
    for start in (LARGE_START, SMALL_START):
        tau = np.full((whitened.joints, len(whitened.unknown.names)), SMALLEST_SIZE)
        tau[at] = start
        gained.append(fit_sizes(whitened, columns, Sizes(tau))[0].log_evidence - without_unknown(whitened, columns).log_evidence)
    return float(max(gained))
