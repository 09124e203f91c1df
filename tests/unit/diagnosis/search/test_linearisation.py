"""Instruments are taken at the reading of the whole model that was found, and about the values of the fit without the unknown."""

import numpy as np
import pytest
import torch
from campaigns import campaign as recorded
from campaigns import planted, steady_table
from diagnosed import FRICTION, searched
from hypotheses import made
from rigs import arm

from nnhydro.diagnosis.problem.hypothesis import Hypothesis
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.search.linearisation import calibrated_with, extend_library, extra_starts, is_stale, scaled_values
from nnhydro.effects.hypotheses.joint_elasticity import RESONANCES
from nnhydro.models.baselines import baseline
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation


@pytest.mark.slow
def test_instruments_are_taken_at_the_reading_of_the_baseline_with_the_loads_found():
    found = searched("rubbing")
    design, search = found.design, found.search
    keys = [search.key(k) for k in range(len(search.view.library.hypotheses))]
    rubs, late = keys.index(("coulomb_friction", 1)), keys.index(("sensor_timing", 0))
    both, alone = (calibrated_with(search, search.score(chosen), None) for chosen in ((rubs, late), (late,)))
    assert calibrated_with(search, search.score((rubs,)), None) is None, "without an instrument nothing is asked of the reading"
    motion = Motion.at([[0.3]] * 2, [[0.5], [-0.5]], [[0.0]] * 2)
    forward, back = (made.loads.torque(Flow(design.problem.arm, motion))[:, 0] for made in (both, alone))
    rubbing = (forward - back)[0] - (forward - back)[1]
    assert float(rubbing) / 2 == pytest.approx(FRICTION, rel=0.15)


@pytest.mark.slow
def test_a_delay_taken_about_its_fitted_value_is_up_to_date_and_one_about_none_or_half_of_it_is_not():
    found = searched("late")
    search, late = found.search, next(k for k in range(len(found.search.view.library.hypotheses))
                                      if found.search.key(k) == ("sensor_timing", 0))
    h = search.view.library.hypotheses[late]
    start = len(search.view.library.hypotheses)
    values = scaled_values(search.view, found.decided.claimed, found.decided.claimed.chosen[0])[0]
    assert float(values[0]) == pytest.approx(0.02, abs=0.001)
    about = [h.linearised_at({0: share * values}, found.model) for share in (1.0, 0.5)]
    search = extend_library(search, search.score((late,)), about, found.model)
    stale = [is_stale(search.view, search.score((k,)), k) for k in (late, start, start + 1)]
    assert stale == [True, False, True]
    assert torch.equal(scaled_values(search.view, search.score((start,)), start)[0].isfinite(), torch.tensor([True]))


ARM = arm(1)
MODEL = StripTheory(ARM, Preparation(None), {}, "constant", baseline("constant").start(ARM))
ALL = [Hypothesis(made(name, ARM, 1)) for name in ("coulomb_friction", "torque_gain", "joint_elasticity")]
MOVING = problem_of(recorded(ARM, planted(ARM), count=3), edge=3.0)


def test_a_soft_drive_is_tried_about_springs_that_resonate_with_the_wet_link_and_loads_are_not():
    extra = extra_starts(ALL, MOVING, MODEL)
    assert {h.key for h in extra} == {("joint_elasticity", 1)}
    inertia = float(MODEL.loads.torque(Flow(ARM, Motion.at([[0.0]], [[0.0]], [[1.0]])))[0, 0])
    resonances = [np.sqrt(1 / (h.effect.compliance[0] * inertia)) / (2 * np.pi) for h in extra]
    assert resonances == pytest.approx(list(RESONANCES), rel=0.01)
    assert all(h.rough and h.working_model is MODEL for h in extra), "their columns are about these values, on the reading of the model"


def test_where_nothing_moves_there_is_nothing_to_start_from():
    table = problem_of(Campaign.of(ARM, [], (steady_table(ARM, planted(ARM)),)))
    assert extra_starts(ALL, table, MODEL) == ()
