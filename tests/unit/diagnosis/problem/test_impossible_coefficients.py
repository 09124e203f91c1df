"""Coefficients that no water has, but that explain the torque, are told with what to check."""

from dataclasses import replace

import pytest
from campaigns import campaign, planted
from rigs import arm

from nnhydro.diagnosis.problem.impossible_coefficients import impossible_coefficients
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.campaign import Campaign

ARM = arm(1)
WHOLE = campaign(ARM, planted(ARM), count=4, noise=0.01)


def drag(r):
    """The drag of a recording, (n, joints) N m, at the planted coefficient."""
    return planted(ARM).terms["normal_drag"].torque(Flow(ARM, Motion(*map(tensor, (r.t, r.q, r.qd, r.qdd, 0 * r.t, 0 * r.t))))).numpy()


def said_of(links):
    """What is said of the recordings beside an arm.yaml with other `links`."""
    stated = ARM.model_copy(update={"links": links})
    return impossible_coefficients(design_on(problem_of(Campaign.of(stated, list(WHOLE.recordings())), edge=3.0), "constant"))


def test_nothing_is_said_of_coefficients_that_water_has():
    assert said_of(ARM.links) == []


@pytest.mark.parametrize("times", [20.0, 100.0])
def test_a_diameter_in_other_units_shows_in_a_drag_coefficient_that_no_cylinder_has(times):
    thin = ARM.links[0].model_copy(update={"diameter_m": ARM.D[0] / times})
    said = " ".join(said_of((thin,)))
    assert "C_D[1]" in said
    assert "can only lie between 0 and 5" in said
    assert "check the lengths, diameters and density" in said


def test_several_coefficients_are_one_sentence():
    design = design_on(problem_of(Campaign.of(ARM, [replace(r, tau=-r.tau) for r in WHOLE.recordings()]), edge=3.0), "constant")
    (said,) = impossible_coefficients(design)
    assert {"normal_drag.C_D[1]", "added_mass.C_M[1]"} <= set(said.split())
    assert said.count("can only lie between") == 1
    assert said.count("check the lengths") == 1


def test_an_omitted_effect_that_hides_in_a_coefficient_of_the_wrong_sign_is_no_matter_of_units():
    pushed = [replace(r, tau=r.tau - 1.1 * drag(r)) for r in WHOLE.recordings()]
    design = design_on(problem_of(Campaign.of(ARM, pushed), edge=3.0), "constant")
    assert impossible_coefficients(design) == []


def test_nothing_is_said_where_free_coefficients_explain_little_of_it_either():
    """A spring holds most of the torque: a diameter a hundred times too small is then no explanation."""
    pulled = [replace(r, tau=r.tau + 30.0 * r.q) for r in WHOLE.recordings()]
    thin = ARM.model_copy(update={"links": (ARM.links[0].model_copy(update={"diameter_m": ARM.D[0] / 100}),)})
    assert impossible_coefficients(design_on(problem_of(Campaign.of(thin, pulled), edge=3.0), "constant")) == []
