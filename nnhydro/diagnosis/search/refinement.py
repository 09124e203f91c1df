"""Finer values of the selected effects: nonlinear parameters at the peak of the score, instruments linearised about their values."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nnhydro.diagnosis.problem.hypothesis import Hypothesis, refine_grid
from nnhydro.diagnosis.search.gauss_newton import at_best_values
from nnhydro.diagnosis.search.linearisation import calibrated_with, extend_library, is_stale, scaled_values
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import GrownSearch, Search
from nnhydro.diagnosis.search.wave_frequencies import lines_at_peak
from nnhydro.effects.effect import InstrumentEffect
from nnhydro.models.strip_theory import StripTheory

ROUNDS, PER_RECORDING_ROUNDS = 5, 5  # iterations of finer values, and of finer values for each recording
ONE_DEVIATION = 0.5  # nats: one standard deviation; a round that gains less is the last


def with_smallest_waves(search: Search, best: ScoredSet, model: StripTheory) -> GrownSearch:
    """Return `best` with what has a direction in the one, of those that fit equally well, in which the water moves least.

    Where a held link meets the part of a wave across it alone, a = a_n / |cos x| with equally likely angles x has its mode at a_n.
    """
    for k in best.chosen:
        hypotheses = search.view.library.hypotheses
        h = hypotheses[k]
        if not h.per_recording or h.values_by_recording or "direction" not in h.spans:
            continue
        others, start = best.without(k), len(hypotheses)
        alike = [other for other in hypotheses if other.key == h.key and not other.values_by_recording]
        directions = {getattr(other.effect, "direction"): other.spans["direction"] for other in alike}  # noqa: B009
        turned = [h.with_nonlinear({"direction": direction}, {"direction": span}) for direction, span in directions.items()]
        search = extend_library(search, best, turned, model)
        sets = {i: search.score((*others, i)) for i in (k, *range(start, start + len(turned)))}
        top = max(scored.score for scored in sets.values())
        near = {i: scored for i, scored in sets.items() if scored.score > top - ONE_DEVIATION}
        best = near[min(near, key=lambda i: float(sum((x**2).sum() for x in scaled_values(search.view, near[i], i).values())))]
    return GrownSearch(search, best)


def _finer(search: Search, found: ScoredSet, k: int, model: StripTheory, first: bool) -> list[Hypothesis]:
    """Return neighbours of hypothesis `k`; instruments, itself among them, about the values that fit each best."""
    h = search.view.library.hypotheses[k]
    if h.values_by_recording or (h.rough and not isinstance(h.effect, InstrumentEffect)):
        return []
    made = [] if h.rough else list(refine_grid(h)[1:])
    if not isinstance(h.effect, InstrumentEffect) or h.per_recording:
        return made
    alone = first and not h.rough and len(h.spans) == 1
    return _about_fit(search, found, k, [h, *made, *(_ends(h) if alone else [])], model, again=first)


def _ends(h: Hypothesis) -> list[Hypothesis]:
    """Return `h` with each of its nonlinear values at each end of its span that lies within its bounds."""
    limits = {field.name: field.metadata["bounds"] for field in h.effect.parameters()}
    return [_at_end(h, name, end) for name, span in h.spans.items() for end in span if limits[name][0] <= end <= limits[name][1]]


def _at_end(h: Hypothesis, name: str, end: float) -> Hypothesis:
    """Return `h` with the value `end` of `name`, and as far beyond it as `h` lies before it."""
    value = getattr(h.effect, name)[0]
    beyond = end**2 / value if min(value, end) > 0 else 2 * end - value
    return h.with_nonlinear({name: (end,)}, {name: (min(value, beyond), max(value, beyond))})


def _about_fit(search: Search, found: ScoredSet, k: int, laws: Sequence[Hypothesis], model: StripTheory, again: bool) -> list[Hypothesis]:
    """Return instrument `laws` in place of member `k`, their columns about its values; `again`: about those that fit each best, too."""
    others, start = found.without(k), len(search.view.library.hypotheses)
    about = [hypothesis.linearised_at(scaled_values(search.view, found, k), model) for hypothesis in laws]
    if not again:
        return about
    there = extend_library(search, found, about, model)
    return [hypothesis.linearised_at(scaled_values(there.view, there.score((*others, start + i)), start + i), model)
            for i, hypothesis in enumerate(about)]


def _peak(low: tuple[float, float], middle: tuple[float, float], high: tuple[float, float]) -> float:
    """Return where the parabola through three points (value, score) is highest between them; in the logarithm of positive values."""
    points = (low, middle, high)
    x = np.array([np.log(value) if low[0] > 0 else value for value, _ in points])
    scores = np.array([score for _, score in points])
    bend, slope, _ = np.polyfit(x - x[1], scores, 2)
    at = float(np.clip(x[1] - slope / (2 * bend), x[0], x[2])) if bend < 0 else float(x[np.argmax(scores)])
    return float(np.exp(at)) if low[0] > 0 else at


def at_peak(h: Hypothesis, score: float, neighbours: Sequence[tuple[Hypothesis, float]]) -> Hypothesis | None:
    """Return `h` where parabolas through its score and those of its `neighbours` are highest; None where that is no new place."""
    changes: dict[str, Any] = {}
    spans = dict(h.spans)
    for name in h.spans:
        value = getattr(h.effect, name)[0]
        others = [(getattr(other.effect, name)[0], s, other) for other, s in neighbours if getattr(other.effect, name)[0] != value]
        low, high = ([o for o in others if (o[0] < value) == lower] for lower in (True, False))
        there = [*sorted(low, key=lambda o: o[0])[-1:], *sorted(high, key=lambda o: o[0])[:1]]
        if len(there) == 2 and there[0][0] < value < there[1][0]:
            peak = _peak(there[0][:2], (value, score), there[1][:2])
            at_end = [o for place, _, o in there if np.isclose(place, peak, rtol=1e-9)]
            spans[name] = at_end[0].spans[name] if at_end else (there[0][0], there[1][0])
            changes[name] = (peak,) * len(getattr(h.effect, name))
    made = replace(h, effect=replace(h.effect, **changes), spans=spans)
    return None if any(made.effect == other.effect for other in (h, *(other for other, _ in neighbours))) else made


def refine(search: Search, best: ScoredSet, model: StripTheory, rounds: int = ROUNDS) -> GrownSearch:
    """Return the best set with finer values of its members: half-way between the values around the best, then where all have their peak.

    What has values per recording is then taken about these; at last all values move together to where they fit best.
    """
    on_lines = lines_at_peak(search, best, model)
    search, best = on_lines.search, on_lines.best
    moving = set(best.chosen)
    for number in range(rounds):
        before, model = best, calibrated_with(search, best, model)
        finer = {k: _finer(search, best, k, model, number == 0) for k in best.chosen if k in moving}
        if not any(finer.values()):
            break
        search, best, peaks = _exchange(search, best, finer, model)
        search, best, _ = _exchange(search, best, peaks, model)
        moving = set(best.chosen) - set(before.chosen)
        if abs(best.score - before.score) < ONE_DEVIATION:
            break
    model = calibrated_with(search, best, model)
    smallest = with_smallest_waves(search, best, model)
    found = _relinearise_per_recording(smallest.search, smallest.best, model)
    found = at_best_values(found.search, found.best, model)
    for _ in range(rounds):
        before = found.best
        found, model = _relinearise(found, model)
        if found.best.score < before.score + ONE_DEVIATION:
            break
        found = at_best_values(found.search, found.best, model)
    return found


def _about_values(search: Search, now: ScoredSet, model: StripTheory, per_recording: bool) -> GrownSearch | None:
    """Return the set with its instruments about their values on `model`: those with values of each recording, or the others.

    None where it has no such instruments.
    """
    laws = search.view.library.hypotheses
    about = {k: laws[k].linearised_at(scaled_values(search.view, now, k), model) for k in now.chosen
             if isinstance(laws[k].effect, InstrumentEffect) and laws[k].per_recording == per_recording}
    if not about:
        return None
    grown = extend_library(search, now, list(about.values()), model)
    return GrownSearch(grown, grown.score((*(k for k in now.chosen if k not in about), *range(len(laws), len(laws) + len(about)))))


def _relinearise(found: GrownSearch, model: StripTheory) -> tuple[GrownSearch, StripTheory]:
    """Return the set with its instruments about their values on the calibrated baseline, and this: each was fitted beside the other.

    Where an instrument changes much of the torque, as a long lag does, coefficients and values agree only after some rounds.
    """
    for _ in range(ROUNDS):
        model = calibrated_with(found.search, found.best, model)
        now = _about_values(found.search, found.best, model, per_recording=False)
        if now is None or now.best.score < found.best.score:
            break
        before, found = found, now
        if found.best.score < before.best.score + ONE_DEVIATION:
            break
    return found, model


def _same_shape(first: Hypothesis, other: Hypothesis) -> bool:
    """Return whether both have the same nonlinear values."""
    return all(getattr(first.effect, name) == getattr(other.effect, name) for name in other.spans)


def _relinearise_per_recording(search: Search, best: ScoredSet, model: StripTheory) -> GrownSearch:
    """Return the best set with the columns of members that have values per recording about these, by Newton's method."""
    found = now = GrownSearch(search, best)
    for _ in range(PER_RECORDING_ROUNDS):
        following = _about_values(now.search, now.best, model, per_recording=True)
        if following is None:
            break
        now = following
        found = max(found, now, key=lambda grown: grown.best.score)
    return found


def _exchange(search: Search, best: ScoredSet, finer: Mapping[int, Sequence[Hypothesis]],
              model: StripTheory) -> tuple[Search, ScoredSet, dict[int, list[Hypothesis]]]:
    """Return the grown search, the best set with members exchanged for their `finer` hypotheses, and what of its members is at the peak."""
    if not any(finer.values()):
        return search, best, {}
    view = search.view
    start = len(view.library.hypotheses)
    following = extend_library(search, best, [h for hs in finer.values() for h in hs], model)
    now, peaks = following.score(best.chosen), dict[int, list[Hypothesis]]()
    for k, hs in finer.items():
        h, rest = view.library.hypotheses[k], now.without(k)
        sets = {start + i: following.score((*rest, start + i)) for i in range(len(hs))}
        start += len(hs)
        scored = [(o, scored.score) for o, scored in zip(hs, sets.values(), strict=True)]
        centre, score = next(((o, s) for o, s in scored if _same_shape(o, h)), (h, now.score))
        peak = at_peak(centre, score, [(other, s) for other, s in scored if other.working_model is centre.working_model])
        number = max(sets, key=lambda i: sets[i].score, default=k)
        if number != k and (sets[number].score > now.score or h.rough or is_stale(following.view, now, k)):
            now = sets[number]
        else:
            number = k
        if peak is not None:
            peaks[number] = [peak]
    return following, now, peaks


def _in_other_form(search: Search, single: ScoredSet) -> list[tuple[int, ...]]:
    """Return the best law of each other form of the effect of `single` that has nonlinear values: it may be best between them."""
    hypotheses = search.view.library.hypotheses
    found = hypotheses[single.chosen[0]]
    forms: dict[tuple[str, ...], list[int]] = {}
    for i, hypothesis in enumerate(hypotheses):
        other = tuple(sorted(hypothesis.spans))
        if hypothesis.key == found.key and other and other != tuple(sorted(found.spans)) and hypothesis.activity is None:
            forms.setdefault(other, []).append(i)
    return [max((search.score((i,)) for i in form), key=lambda s: s.score).chosen for form in forms.values()]


def with_finer_singles(search: Search, model: StripTheory) -> Search:
    """Return the search with finer values of the law that is best alone, and of the one that leaves least to the unknown in all its forms.

    What a law about zero leaves, others would be found for. A law that leaves less than the best may be better at values between those of
    the grid, and so may be another form of its effect.
    """
    singles = search.singles()
    least = min(singles, key=lambda s: s.unknown_nats)  # the best itself where both leave the same
    for single in dict.fromkeys((singles[0].chosen, least.chosen, *_in_other_form(search, least))):
        search = refine(search, search.score(single), model).search
    return Search(search.view, search.start, search.report)  # beside others they may have other values: nothing is settled
