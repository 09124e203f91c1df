"""Values of an instrument from which the search starts, too: those that its card wants to be tried on the motions at hand."""

import numpy as np
import pytest
from campaigns import campaign, planted, steady_table
from hypotheses import made
from rigs import arm

from nnhydro.diagnosis.problem.hypothesis import Hypothesis
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.search.starts import extra_starts
from nnhydro.effects.hypotheses.joint_elasticity import RESONANCES
from nnhydro.models.baselines import baseline
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation

ARM = arm(1)
MODEL = StripTheory(ARM, Preparation(None), {}, "constant", baseline("constant").start(ARM))
ALL = [Hypothesis(made(name, ARM, 1)) for name in ("coulomb_friction", "torque_gain", "joint_elasticity")]
MOVING = problem_of(campaign(ARM, planted(ARM), count=3), edge=3.0)


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
