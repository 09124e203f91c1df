"""A planted effect is named, a healthy arm is left alone; the truth is computed by code that shares nothing with the catalogue."""

import json

import pytest

from nnhydro.cli.main import run

pytestmark = pytest.mark.slow


def diagnosed(tmp_path, effect, seed):
    assert run(["conceal", "--out", str(tmp_path / "suite"), "--effect", effect, "--links", "2", "--seed", str(seed)]) == 0
    assert run(["diagnose", str(tmp_path / "suite" / "campaign_000"), "--out", str(tmp_path / "out")]) == 0
    return json.loads((tmp_path / "out" / "diagnosis.json").read_text())


@pytest.mark.parametrize(("effect", "seed"), [("umbilical_stiffness", 3), ("torque_bias", 4), ("rotor_inertia", 5)])
def test_a_planted_effect_is_named_and_the_corrected_model_predicts_better(tmp_path, effect, seed):
    told = diagnosed(tmp_path, effect, seed)
    assert told["mismatch"]["detected"]
    assert effect in {name for f in told["findings"] for name in f["class"]}
    assert told["findings"][0]["heldout"]["error_after"] < told["mismatch"]["error"]


def test_a_healthy_arm_is_left_alone(tmp_path):
    told = diagnosed(tmp_path, "none", 6)
    assert told["findings"] == []
    assert not told["mismatch"]["detected"]
