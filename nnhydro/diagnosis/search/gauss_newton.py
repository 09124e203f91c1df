"""Steps of Gauss and Newton for the nonlinear values of a set: to where they, and the linear values with them, fit best together.

    (beta, phi) -> (beta + dbeta, phi + dphi),   the fit of D dphi + X (beta + dbeta)          (search.tangents)

Values that move together, a wave's frequency and its direction, one at a time reach no peak. Source: Seber & Wild (1989), section 2.1.2.
"""

import numpy as np
import torch

from nnhydro.diagnosis.problem.hypothesis import Hypothesis, Span
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.linearisation import extend_library
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import GrownSearch, Search
from nnhydro.diagnosis.search.tangents import NewtonStep, shift_values, step_of, tangents_of
from nnhydro.effects.effect import InstrumentEffect
from nnhydro.models.strip_theory import StripTheory

STEPS, HALVINGS = 5, 3  # most steps, and halvings of one step
ALIKE = 0.5  # nats of the score that a step may lose: one standard deviation


def _move(search: Search, found: ScoredSet, k: int, step: NewtonStep, share: float) -> Hypothesis:
    """Return member `k` after `share` of the step; an instrument about its values there."""
    view, library = search.view, search.view.library
    h, there = library.hypotheses[k], step.tangents.now + share * step.phi
    values, spans = dict[str, float](), dict[str, Span]()
    for i in step.tangents.at(k):
        name, (low, high) = step.tangents.names[i][1], step.tangents.limits[i]
        values[name] = float(there[i])
        spans[name] = (max(values[name] - step.deviation[i], low), min(values[name] + step.deviation[i], high))
    made = shift_values(h, values).with_nonlinear({}, spans)
    if not isinstance(h.effect, InstrumentEffect) or h.working_model is None:
        return made
    lowest, highest = library.bounds(k)
    before = best_fit(search, found).posterior.mean
    place = found.places(view)[k]
    mean = before[place] + share * (step.mean[place] - before[place])
    beta = np.clip(mean.reshape(-1, h.width), lowest, highest) * library.scale[library.at(k)]
    groups = view.acting_groups(k) if h.per_recording else [0]
    if h.values_by_recording or not h.per_recording:
        made = made.linearised_at(dict(zip(groups, torch.from_numpy(beta), strict=True)), h.working_model)
    return made


def at_best_values(search: Search, best: ScoredSet, model: StripTheory) -> GrownSearch:
    """Return `best` with its nonlinear values where they fit best with all others, as far as the score agrees."""
    for _ in range(STEPS):
        tangents = tangents_of(search, best)
        if tangents is None or (step := step_of(search, best, tangents)).settled:
            break
        moving = list(dict.fromkeys(k for k, _ in step.tangents.names))
        others = [k for k in best.chosen if k not in moving]
        before = best
        for halving in range(HALVINGS):
            start = len(search.view.library.hypotheses)
            there = [_move(search, before, k, step, 0.5**halving) for k in moving]
            search = extend_library(search, before, there, model)
            now = search.score((*others, *range(start, start + len(moving))))
            if now.score > before.score - ALIKE:
                best = now
                break
        if best is before:
            break
    return GrownSearch(search, search.score(best.chosen))
