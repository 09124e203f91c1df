"""The tables of a finding: one row per parameter, a row a rival, whatever acts on the whole arm in words."""

from nnhydro.diagnosis.findings.sheets import parameters_sheet, rivals_sheet

FINDING = {"effect": "coulomb_friction", "joint": 2, "parameters": {"level": {"value": 0.3, "unit": "N m", "ci95": [0.2, 0.4]}},
           "rivals": [{"effect": "tip_drag", "joint": None, "support": 0.0001},
                      {"effect": "stribeck_friction", "joint": 2, "support": 0.2}]}


def test_every_parameter_has_a_row_with_its_interval_and_unit():
    assert parameters_sheet([FINDING]).rows() == [["coulomb_friction", "2", "level", "0.3", "0.2 to 0.4", "N m"]]
    assert len(parameters_sheet([])) == 0


def test_rivals_are_listed_with_their_weights_and_the_whole_arm_by_its_name():
    assert rivals_sheet(FINDING).rows() == [["tip_drag", "arm", "< 0.001"], ["stribeck_friction", "2", "0.200"]]
