"""One diagnosis against one answer: what counts as right, and what as a false claim."""

import pytest
from answers import ANSWER, finding, of, said

from nnhydro.errors import ConfigError

BENT = {**ANSWER, "kind": "base_form", "strength": None, "effects": [
    {"effect": "base_form:span", "family": None, "joint": None, "shape": "base_form", "near": ["drag_form"], "parameters": {}}]}


def test_a_perfect_diagnosis_is_right_in_every_way():
    numbers = {"stiffness": {"value": 0.51, "unit": "N m/rad", "ci95": [0.48, 0.54]},
               "centre": {"value": 0.3, "unit": "rad", "ci95": [0.25, 0.35]}}
    verdict = of(ANSWER, said(finding("umbilical_stiffness", parameters=numbers)))
    assert (verdict.right, verdict.exact, verdict.family, verdict.joint, verdict.false_claims) == (True, True, True, True, 0)
    assert verdict.pairs == (("umbilical_stiffness", "umbilical_stiffness"),)
    stiffness, centre = verdict.parameters
    assert stiffness.error == pytest.approx(0.02)
    assert stiffness.covered
    assert not centre.covered  # matched by its unit: the only rad on either side


def test_a_wrong_name_is_a_false_claim_and_a_line_of_the_confusion_table():
    verdict = of(ANSWER, said(finding("torque_bias", family="torque_sensor")))
    assert (verdict.right, verdict.family, verdict.false_claims) == (False, False, 1)
    assert verdict.pairs == (("umbilical_stiffness", "torque_bias"),)
    assert of(ANSWER, said(finding("buoyancy_tilt"))).family


def test_an_honest_class_counts_and_a_long_one_does_not():
    short = of(ANSWER, said(finding("torque_drift", alternatives=("torque_bias", "umbilical_stiffness"))))
    assert (short.right, short.exact, short.class_sizes) == (True, False, (3,))
    long = of(ANSWER, said(finding("torque_drift", alternatives=("torque_bias", "umbilical_stiffness", "buoyancy_tilt"))))
    assert not long.right


def test_the_wrong_joint_is_seen():
    assert not of(ANSWER, said(finding("umbilical_stiffness", joint=1))).joint


def test_a_further_claim_beside_the_right_one_is_false():
    verdict = of(ANSWER, said(finding("umbilical_stiffness"), finding("sensor_timing", None)))
    assert (verdict.right, verdict.false_claims) == (False, 1)
    assert ("nothing", "sensor_timing") in verdict.pairs


def test_each_hidden_effect_needs_a_claim_of_its_own():
    two = {**ANSWER, "effects": [*ANSWER["effects"], {**ANSWER["effects"][0], "effect": "torque_bias", "family": "torque_sensor"}]}
    shared = finding("umbilical_stiffness", alternatives=("torque_bias",))
    assert not of(two, said(shared)).right
    assert of(two, said(shared, finding("torque_bias"))).right


def test_a_baseline_wrong_in_form_may_be_called_so_or_left_alone():
    assert of(BENT, said(finding("drag_form", None, family="drag_law"))).right
    assert of(BENT, said()).right
    assert of(BENT, said(finding("sensor_timing", None))).false_claims == 1


@pytest.mark.parametrize("broken", [{}, {"findings": 3}, {"findings": [{"class": []}]}, {"findings": ["bias"]}])
def test_what_is_no_diagnosis_is_refused_with_its_file(broken):
    with pytest.raises(ConfigError, match=r"diagnosis\.json: is not a diagnosis"):
        of(ANSWER, broken)
