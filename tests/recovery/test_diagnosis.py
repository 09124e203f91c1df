"""A planted effect is named, a healthy arm is left alone; the truth is computed by code that shares nothing with the catalogue."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from nnhydro.blind_tests.seal import open_sealed, read_key
from nnhydro.cli.main import run
from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.errors import RecordingError
from nnhydro.models.prediction import predict
from nnhydro.models.storage import load_model, save_model
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import open_campaign

pytestmark = pytest.mark.slow(seconds=10)


def diagnosed(tmp_path, effect, seed):
    conceal = ["conceal", "--out", str(tmp_path / "suite"), "--effect", effect, "--links", "2", "--size", "small", "--seed", str(seed)]
    assert run(conceal) == 0
    assert run(["diagnose", str(tmp_path / "suite" / "campaign_000"), "--out", str(tmp_path / "out")]) == 0
    return json.loads((tmp_path / "out" / "diagnosis.json").read_text())


@pytest.mark.parametrize(("effect", "seed"), [("umbilical_stiffness", 3), ("torque_bias", 4), ("rotor_inertia", 5)])
def test_a_planted_effect_is_named_and_the_corrected_model_predicts_better(tmp_path, effect, seed):
    told = diagnosed(tmp_path, effect, seed)
    assert told["mismatch"]["detected"]
    assert effect in {name for f in told["findings"] for name in f["class"]}
    assert told["findings"][0]["heldout"]["error_after"] < told["mismatch"]["error"]
    assert {path.stem for path in (tmp_path / "out").glob("*.svg")} == {"torque_history", "residual_map", "laws"}


def test_a_healthy_arm_is_left_alone(tmp_path):
    told = diagnosed(tmp_path, "none", 6)
    assert told["findings"] == []
    assert not told["mismatch"]["detected"]


SUITE = Path(__file__).parents[2] / "datasets" / "concealed"


def _hidden(effect):
    key = read_key(SUITE / "key.txt")
    for sealed in sorted((SUITE / "answers").glob("*.sealed")):
        if [e["effect"] for e in open_sealed(sealed, key)["effects"]] == [effect]:
            return SUITE / sealed.stem
    raise AssertionError(effect)


def test_the_users_own_simulation_may_be_the_baseline_as_a_column_or_as_a_model_file(tmp_path):
    place = _hidden("umbilical_stiffness")
    campaign = open_campaign(place)
    assert run(["identify", str(place), "--out", str(tmp_path / "model")]) == 0
    model = load_model(tmp_path / "model")
    names = campaign.names[::2]
    left_out = shutil.ignore_patterns(*(f"{name}.csv" for name in campaign.names[1::2]))  # four recordings show it as well as eight
    shutil.copytree(place, tmp_path / "campaign", ignore=left_out)
    for name in names:
        file = tmp_path / "campaign" / "recordings" / f"{name}.csv"
        table, tau = pd.read_csv(file), predict(model, campaign.load(name)).tau
        for joint in range(tau.shape[1]):
            table[f"tau{joint + 1}_sim_Nm"] = tau[:, joint]
        table.to_csv(file, index=False)
    simulated = open_campaign(tmp_path / "campaign")
    for given in ("column", str(tmp_path / "model")):
        result = diagnose(simulated, given)
        assert [f.effect for f in result.findings] == ["umbilical_stiffness"]
        assert result.heldout.after < 0.7 * result.heldout.before
        save_model(result.corrected, tmp_path / "corrected")
        again = load_model(tmp_path / "corrected")
        motion = Motion.at(np.zeros((1, len(campaign.arm.links))), *[np.zeros((1, len(campaign.arm.links)))] * 2)
        assert torch.equal(again.torque(motion), result.corrected.torque(motion))
    with pytest.raises(RecordingError, match="tau1_sim_Nm"):
        diagnose(campaign, "column")


def test_what_the_unknown_held_is_gone_with_the_finding():
    told = diagnose(open_campaign(_hidden("umbilical_stiffness"))).document()["proof"]
    assert told["explained"] > 0.9
    assert told["unknown_nats"]["after"] < 0.1 * told["unknown_nats"]["before"]


def test_beside_curves_over_the_travel_the_cylinder_of_a_flow_solver_still_differs_and_nothing_but_its_wake_or_drag_may_be_named():
    found = diagnose(open_campaign(SUITE.parent / "cfd_cylinder"), "state")
    assert found.detected  # the wake that is met again after stops and reversals is no law of the travel
    assert {f.law.family for f in found.findings} <= {"wake", "drag_law"}  # at such Reynolds numbers viscous drag is part of it
    assert found.findings or found.remainder.detected
