"""The analytic baselines by name."""

from dataclasses import replace

import pytest
from rigs import arm, assert_close, run
from untrained import learned

from nnhydro.errors import ConfigError, ModelError
from nnhydro.models.baselines import BASELINES, baseline, physics_model
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


@pytest.mark.parametrize(("name", "advised"), [("state", "state"), ("of a diagnosis", "constant")])
def test_a_hybrid_is_no_physics_model_and_its_baseline_is_named(name, advised):
    hybrid = learned(arm(1), hybrid=True)
    base = replace(hybrid.baseline, name=name)
    with pytest.raises(ModelError, match=rf"a hybrid has no masses, .* identify CAMPAIGN --model {advised} --out PHYSICS, and"):
        physics_model(replace(hybrid, baseline=base), "masses")
    assert physics_model(base, "masses") is base
