"""A diagnosis says the same in Python as in its file."""

import json

import numpy as np
import pytest
from campaigns import campaign, planted
from rigs import arm

import nnhydro
from nnhydro.physics.loads.viscous_friction import ViscousTerm


@pytest.mark.slow
def test_a_diagnosis_says_the_same_in_python_as_in_its_file(tmp_path):
    one = arm(1)
    c = campaign(one, planted(one).plus("viscous_friction", ViscousTerm((0.5,))), count=5, noise=0.01, rate=50.0)
    found = nnhydro.diagnose(c)
    assert found.findings
    document = json.loads((found.save(tmp_path / "d")[0]).read_text())
    assert [f.effect for f in found.findings] == [f["effect"] for f in document["findings"]]
    assert found.detected == document["mismatch"]["detected"]
    assert len(found.to_frame()) == len(found.findings)
    assert found.verdict() in repr(found)
    assert found.baseline.name == "constant"
    run = c.load("run0")
    np.testing.assert_array_equal(found.corrected.predict(run).tau, nnhydro.load_model(tmp_path / "d" / "model").predict(run).tau)
