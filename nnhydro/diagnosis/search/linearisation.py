"""Instrument effects linearised about values other than 0: further starts of the search, and the values fitted in a set.

The sensors read the motion and torque of the baseline, calibrated together with the loads of the set.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from nnhydro.diagnosis.model.sizes import without_unknown
from nnhydro.diagnosis.problem.hypothesis import Hypothesis
from nnhydro.diagnosis.problem.problem import Problem
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary
from nnhydro.effects.effect import InstrumentEffect, LoadEffect
from nnhydro.effects.sensor_view import SensorView
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion

STALE = 0.03  # relative change of the fitted values from which columns are linearised again: curvature is then known to 3 %


def scaled_values(view: WeightedLibrary, found: ScoredSet, k: int) -> dict[int, torch.Tensor]:
    """Return the linear values (width,) of hypothesis `k` in its units, within physical bounds: of all (0), or each recording's own.

    They are those of the fit without the unknown, which would take a part of an effect for its own.
    """
    library, whitened = view.library, view.whitened
    at, h = found.places(view)[k], library.hypotheses[k]
    low, high = library.bounds(k)
    fit = without_unknown(whitened, view.join(found.chosen))
    beta = np.clip(fit.mean[at].reshape(-1, h.width), low, high) * library.scale[library.at(k)]
    return dict(zip(view.acting_groups(k) if h.per_recording else [0], torch.from_numpy(beta), strict=True))


def calibrated_with(search: Search, found: ScoredSet, model: StripTheory) -> StripTheory:
    """Return the baseline calibrated beside `found` with the loads found: at its reading instruments are taken; `model` without any."""
    view = search.view
    laws = {k: view.library.hypotheses[k] for k in found.chosen}
    if not any(isinstance(hypothesis.effect, InstrumentEffect) for hypothesis in laws.values()):
        return model
    fit = without_unknown(view.whitened, view.join(found.chosen))
    base = view.library.design.baseline
    made = base.at(base.within(fit.mean[: view.whitened.p]))
    for k, hypothesis in laws.items():
        if isinstance(hypothesis.effect, LoadEffect) and not hypothesis.per_recording and hypothesis.activity is None:
            effect = hypothesis.with_values(scaled_values(view, found, k)[0])
            assert isinstance(effect, LoadEffect)
            made = replace(made, loads=made.loads.plus(f"found {k}", effect))
    return made


def is_stale(view: WeightedLibrary, found: ScoredSet, k: int) -> bool:
    """Return whether the columns of instrument `k` were taken about no values or others than those fitted: they are not its reading."""
    h = view.library.hypotheses[k]
    if not isinstance(h.effect, InstrumentEffect) or h.per_recording:
        return False
    if h.working_model is None:
        return True
    fitted, about = scaled_values(view, found, k)[0][: len(h.effect.linear_names())], h.effect.linear_values()
    return float((fitted - about).norm()) > STALE * float(fitted.norm())


def extend_library(search: Search, best: ScoredSet, more: Sequence[Hypothesis], model: StripTheory) -> Search:
    """Return the search in the library with `more` hypotheses, which are no further laws."""
    view = search.view
    grown = view.library.with_more(Library.of(view.library.design, more, model), view.library.key_counts)
    settled = {hypothesis.key for hypothesis in more if hypothesis.working_model is not None and not hypothesis.rough}
    return Search(WeightedLibrary(view.whitened, grown, before=view), best.sizes, search.report, search.settled | settled)


def extra_starts(hypotheses: Sequence[Hypothesis], problem: Problem, model: StripTheory) -> tuple[Hypothesis, ...]:
    """Return hypotheses linearised about the values from which an instrument's card wants to be tried, too, on the longest stretch."""
    moving = [stretch for stretch in problem.stretches if not stretch.segment.steady]
    if not moving:
        return ()
    longest = max(moving, key=lambda stretch: len(stretch.segment))
    flow = Flow(model.arm, Motion.of(longest.segment))
    view = SensorView.of(model.loads, flow)
    return tuple(replace(hypothesis, effect=start, working_model=model, rough=True) for hypothesis in hypotheses
                 if isinstance(hypothesis.effect, InstrumentEffect) for start in hypothesis.effect.extra_starts(view))
