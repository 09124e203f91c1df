"""What an error in the form of one law gains for another law: what a hose has beyond a spring may look like friction."""

from collections.abc import Sequence

from nnhydro.diagnosis.constants import FORM
from nnhydro.diagnosis.problem.hypothesis import AnyEffect
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search


def form_bars(search: Search, now: ScoredSet, rests: Sequence[ScoredSet]) -> list[float]:
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
    exactly = [more > 0 and less <= FORM * more and whole > bar
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
