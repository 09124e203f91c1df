"""The parameters of a model as a sheet, and the model in one sentence."""

from dataclasses import replace

import torch
from campaigns import GIVEN, planted
from rigs import arm
from untrained import learned

from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.strip_theory import StripTheory
from nnhydro.report.models.parameter_sheet import model_sentence, parameter_sheet

TWO = arm(2)
THEORY = StripTheory(TWO, GIVEN, {}, "constant", planted(TWO))
FITTED = {"parameters": {"normal_drag.C_D[1]": {"value": 0.91, "unit": "1", "ci95": [0.9, 0.92]},
                         "normal_drag.C_D[2]": {"value": 1.3, "unit": "1", "note": "not determined"}},
          "rms_residual_Nm": [0.1, 0.02], "recordings": 1}


def test_every_parameter_stands_with_its_link_and_unit():
    rows = {row[0]: row[1:] for row in parameter_sheet(THEORY).rows()}
    assert rows["normal_drag.C_D[1]"] == ["0.9", "", "1", ""]
    assert rows["normal_drag.C_D[2]"] == ["1.3", "", "1", ""]
    assert rows["added_mass.C_M[2]"][0] == "0.6"
    one = parameter_sheet(replace(THEORY, arm=arm(1), loads=planted(arm(1))))
    assert "normal_drag.C_D" in [row[0] for row in one.rows()], "one needs no number"


def test_a_fit_stands_with_its_intervals_and_notes_instead():
    assert parameter_sheet(replace(THEORY, fit=FITTED)).rows() == [
        ["normal_drag.C_D[1]", "0.91", "0.9 to 0.92", "1", ""], ["normal_drag.C_D[2]", "1.3", "", "1", "not determined"]]


def test_of_a_corrected_simulation_the_correction_is_shown():
    before = replace(THEORY, loads=planted(TWO, C_D=(0.1, 0.1)))
    corrected = CorrectedSimulation(TWO, GIVEN, {}, None, before, THEORY)
    assert parameter_sheet(corrected).rows() == parameter_sheet(THEORY).rows()


def test_a_learned_model_shows_how_it_is_built():
    model = learned(TWO, hybrid=True, hidden=(8, 5))
    rows = dict(parameter_sheet(model).rows())
    assert (rows["hidden layers"], rows["members"], rows["inputs"]) == ("8 x 5", "3", str(len(model.centre)))
    assert rows["epochs"] == rows["recordings"] == "", "of a model that nothing trained"
    assert "trained memory" not in rows


def test_the_sentence_tells_joints_fit_and_training():
    assert model_sentence(THEORY) == "constant, 2 joints."
    fitted = model_sentence(replace(THEORY, fit=FITTED))
    assert fitted == "constant, 2 joints; rms residual by joint 0.1, 0.02 N m, on the 1 recording of the fit."
    trained = replace(learned(TWO, hybrid=True), fit={"best_epoch": [3.0, 12.0], "epochs": 20})
    assert model_sentence(trained).endswith(
        "on constant, 2 joints; trained for 20 epochs, lowest validation error at epochs 3, 12, one for each member.")
    unused = replace(trained, fit={"best_epoch": [0.0, 0.0], "epochs": 20}, trust=torch.zeros(2, dtype=torch.float64))
    assert model_sentence(unused).endswith("no network improved on its start, so the networks add no torque; nothing learned is used: the "
                                           "torques are those of constant.")
    half = replace(trained, trust=torch.tensor([0.5, 1.0], dtype=torch.float64))
    assert model_sentence(half).endswith("; of what was learned beside constant, 50 % and 100 % are used, by joint.")
    assert " on " not in model_sentence(learned(arm(1), hybrid=False)).split(",")[0]
    assert "1 joint." in model_sentence(learned(arm(1), hybrid=False))
