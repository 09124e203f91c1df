"""Machines that nothing drives: what holds their scale, and the factor up to which their equation of motion holds."""

import numpy as np
import pytest
from campaigns import campaign, planted
from diagnosed import hanging
from rigs import arm

from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.design import design_of
from nnhydro.diagnosis.problem.free_machines import scale_direction, scale_factor, shares_of_largest
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation

ARM = arm(1)


def of(whole, edge=1.4):
    """The rows of a campaign against constant coefficients."""
    problem = problem_of(whole, edge=edge)
    return design_of(problem, baseline_of("constant", whole.arm, problem.units(), Preparation(LowPass(edge))))


def test_a_free_machine_with_a_tenth_more_weight_than_the_model_keeps_ten_elevenths_of_the_models_scale():
    """M + 0.1 w = 0, divided by the weight's 1.1: the columns hold no common factor, and the values over what is kept are the machine's."""
    design = of(hanging(), edge=1.4)
    w, model = design.largest_part, design.tau - design.y
    lifted = (w - model)[..., None]  # the column of a load of the weight's form: its share of the weight is 1
    for extra in (0.1, -0.2, 0.5):
        kept = scale_factor(design, lifted, np.array([extra / (1 + extra)]))
        assert kept == pytest.approx(1 / (1 + extra))
        np.testing.assert_allclose(model + extra / (1 + extra) * lifted[..., 0], kept * (model + extra * w), atol=1e-12)
    driven = of(campaign(ARM, planted(ARM), count=4, noise=0.01))
    assert scale_factor(driven, lifted, np.array([0.3])) == 1.0, "torque tells the scale of what is driven"


def test_the_weight_of_a_free_pendulum_is_held_whatever_its_parameters_do():
    design = of(hanging())
    assert shares_of_largest(design, design.largest_part[..., None]) == pytest.approx(1.0)
    draws = np.random.default_rng(0).standard_normal((5, design.Y.shape[2]))
    first = [design.baseline.at(z).loads.terms["rigid_body"].first_moment for z in draws]
    assert np.ptp(first) == pytest.approx(0.0), "its weight stays, its inertia moves beside it"
    assert 0.01 < design.scale_spread < 0.05, "the mass is known to 2 %"
    assert np.allclose(scale_direction(design), 0), "what is held has no further direction"
