"""The sheets of a diagnosis: the ladder of errors, where the residual lies, what came nearest, and nothing where there is nothing."""

from nnhydro.report.diagnosis.tables import errors_sheet, findings_sheet, location_sheet, nearest_sheet, recalibrated_sheet

FINDING = {"effect": "umbilical_stiffness", "joint": 2, "family": "restoring", "class": ["umbilical_stiffness", "torque_drift"],
           "confidence": 0.975, "heldout": {"error_before": 0.21, "error_after": 0.03}}


def document(findings=(FINDING,), given=None, floor=0.012, recalibrated=None):
    """What diagnosis.json holds."""
    return {"findings": list(findings), "mismatch": {"error": 0.2, "noise_floor": floor, "error_as_given": given},
            "recalibrated": recalibrated, "unexplained": {}}


def test_a_finding_stands_with_what_it_cannot_be_told_from():
    assert findings_sheet(document()).rows() == [
        ["umbilical_stiffness", "2", "restoring", "torque_drift", "0.97", "21.0 %", "3.0 %"]]
    alone = FINDING | {"class": ["umbilical_stiffness"], "joint": None}
    assert findings_sheet(document([alone])).rows()[0][1:4] == ["", "restoring", ""]


def test_errors_stand_from_the_simulation_as_it_is_down_to_the_noise():
    assert errors_sheet(document(given=0.5)).rows() == [
        ["simulation as it is", "50.0 %"], ["recalibrated baseline", "20.0 %"], ["corrected model", "3.0 %"], ["noise alone", "1.2 %"]]
    assert errors_sheet(document([], floor=None)).rows() == [["recalibrated baseline", "20.0 %"]]


def test_where_the_residual_lies_is_told_by_joint():
    where = {"location": [{"joint": 2, "share": 0.934, "where": "depends on q2_rad", "band_hz": [0.0, 1.26]}]}
    assert location_sheet(where).rows() == [["2", "93%", "depends on q2_rad", "0 to 1.3"]]


def test_what_came_nearest_is_told_where_something_did():
    assert nearest_sheet(document()) is None
    near = {"unexplained": {"nearest": [{"effect": "wave_orbital", "joint": None, "gain": 3.14, "why": "too few waves"}]}}
    assert nearest_sheet(near).rows() == [["wave_orbital", "arm", "3.1", "too few waves"]]


def test_coefficients_are_told_by_link_and_of_a_simulation_their_changes():
    assert recalibrated_sheet(document()) is None
    assert recalibrated_sheet(document(recalibrated={"cd": []})) is None
    own = recalibrated_sheet(document(recalibrated={"cd": [0.98, 0.91], "cm": [0.83]}))
    assert own.headings() == ["link", "C_D [-]", "C_M [-]"]
    assert own.rows() == [["1", "0.980", "0.830"], ["2", "0.910", ""]]
    assert "coefficients of the baseline" in own.title
    assert "changes of the simulation" in recalibrated_sheet(document(given=0.5, recalibrated={"cd": [0.1]})).title
