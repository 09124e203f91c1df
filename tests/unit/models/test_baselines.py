"""The analytic baselines by name."""

import pytest
from rigs import arm, assert_close, run

from nnhydro.errors import ConfigError
from nnhydro.models.baselines import BASELINES, baseline
from nnhydro.physics.flow import Flow


def test_the_names_are_those_of_the_contract():
    assert list(BASELINES) == ["rigid", "textbook", "drag-only", "constant", "state"]
    assert [name for name, known in BASELINES.items() if known.calibrated] == ["rigid", "constant", "state"]


def test_an_unknown_name_is_refused_with_what_was_meant():
    with pytest.raises(ConfigError, match=r"unknown physics model 'textbok'.*textbook"):
        baseline("textbok")


def test_the_textbook_is_strip_theory_with_its_coefficients():
    terms = BASELINES["textbook"].start(arm(2)).terms
    assert terms["normal_drag"].C_D == (1.2, 1.2)
    assert terms["added_mass"].C_M == (1.0, 1.0)
    assert "added_mass" not in BASELINES["drag-only"].start(arm(2)).terms


def test_in_air_every_baseline_is_the_rigid_arm():
    a = arm(2, density=0.0)
    flow = Flow(a, run(2))
    dry = BASELINES["rigid"].start(a).torque(flow)
    for known in BASELINES.values():
        assert_close(known.start(a).torque(flow), dry)
