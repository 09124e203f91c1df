"""Sealed answers beside the diagnoses: errors of unseen motions, and what is missing."""

import json

import numpy as np
import pytest
from answers import VERDICT, finding, said

from nnhydro.blind_tests.reveal import _errors, reveal, unseen_error
from nnhydro.blind_tests.seal import open_sealed
from nnhydro.errors import ConfigError


def test_the_error_of_unseen_motions_is_pooled():
    unseen = {"a": {"tau_Nm": [[1.0], [-1.0]]}, "b": {"tau_Nm": [[2.0]]}}
    assert unseen_error(unseen, lambda name: np.array(unseen[name]["tau_Nm"]) * 1.1) == pytest.approx(0.1)
    with pytest.raises(ConfigError, match="one for each row"):
        unseen_error(unseen, lambda name: np.zeros((5, 1)))


def test_reveal_scores_predicted_torques_and_lists_what_is_missing(suite, tmp_path):
    answer = open_sealed(suite / "suite/answers/campaign_000.sealed", bytes(range(32)))
    place = tmp_path / "campaign_000"
    (place / "torques").mkdir(parents=True)
    (place / "diagnosis.json").write_text(json.dumps(said(finding("coulomb_friction", 1, family="dry_friction"))))
    for name, motion in answer["unseen"].items():
        table = np.column_stack([motion["t_s"], np.array(motion["tau_Nm"]) * 1.05])
        np.savetxt(place / "torques" / f"{name}.csv", table, delimiter=",", header="t_s,tau1_Nm", comments="")
    document = reveal(suite / "suite", tmp_path, suite / "key.txt")
    assert document["missing"] == ["campaign_001"]
    (verdict,) = document["campaigns"]
    assert verdict["right"]
    assert verdict["error_after"] == pytest.approx(0.05)
    assert verdict["error_before"] is None
    truth = unseen_error(answer["unseen"], lambda name: np.array(answer["unseen"][name]["true_model_Nm"]))
    assert verdict["error_true"] == pytest.approx(truth)
    assert 0 < truth < 0.05


def test_an_answer_of_before_has_no_truth_and_one_without_motions_no_errors(tmp_path):
    (tmp_path / "torques").mkdir()
    assert _errors(VERDICT, {"unseen": {}}, tmp_path, tmp_path) == VERDICT
    told = _errors(VERDICT, {"unseen": {"motion_01": {"t_s": [0.0], "tau_Nm": [[1.0]]}}}, tmp_path, tmp_path)
    assert told.error_true is None
    assert "not scored" in told.notes[0]
    motions = {"motion_01": {"tau_Nm": [[1.0]], "true_model_Nm": [[1.1]]}, "motion_02": {"tau_Nm": [[1.0]], "true_model_Nm": [[0.7]]}}
    assert _errors(VERDICT, {"unseen": motions}, tmp_path, tmp_path).error_true == pytest.approx(0.2), "which needs no model"
