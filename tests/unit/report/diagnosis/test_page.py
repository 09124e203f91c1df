"""What the page of a diagnosis says and draws of each finding: its numbers, the rivals that matter, and what is left."""

import re

import pytest

from nnhydro.report.diagnosis.page import _finding, _next, _rest

FINDING = {"effect": "coulomb_friction", "parameters": {"level": {"value": 0.3, "unit": "N m", "ci95": [0.28, 0.32]}},
           "rivals": [{"effect": "torque_bias", "joint": 2, "support": 0.2549}, {"effect": "wave_orbital", "support": 0.0049}]}


def test_the_weights_that_are_drawn_are_those_of_the_finding_and_of_rivals_that_matter():
    _, law, numbers, rivals, sheet = _finding(FINDING, None)
    assert law is None
    assert "0.3 (0.28 to 0.32) N m" in numbers
    assert re.findall(r">([\d.]+)<", rivals) == ["0.74", "0.25"], "the finding's own weight is what its rivals leave, drawn or not"
    assert "torque_bias (2)" in rivals
    assert "wave_orbital" not in rivals
    assert len(sheet) == 2, "the table has all"


def test_a_finding_without_numbers_or_rivals_has_no_chart():
    assert _finding(FINDING | {"parameters": {}, "rivals": []}, None)[1:4] == (None, None, None)


@pytest.mark.parametrize(("left", "said"), [
    ({"detected": False}, "cannot distinguish the residual from noise"),
    ({"detected": True}, "no effect of the catalogue explains."),
    ({"detected": True, "depends_on": ["q1_rad", "dq1_rad_s"]}, "explains; it depends on q1_rad, dq1_rad_s.")])
def test_what_is_left_is_said_in_words(left, said):
    assert said in _rest({"unexplained": left})


def test_an_experiment_is_told_with_its_file():
    assert _next(None) == ""
    assert _next({"statement": "Swing slowly.", "file": "next.csv"}).startswith("Swing slowly. The file next.csv holds this motion")
