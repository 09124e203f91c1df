"""The line that mends a channel names the user's own column, and pasted it gives what was meant."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from planted import ARM_YAML, healthy, write_csv

from nnhydro.recordings.arm import read_arm
from nnhydro.recordings.readers.column_map import parse_column_map
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.readers.map_line import map_line, mapping_text, yaml_text
from nnhydro.recordings.recording import Origin

WHERE = Origin(mapped={"tau1_Nm": {"from": "M_shoulder", "unit": "N m"}, "tau2_Nm": {"from": "M [elbow]", "unit": "N cm", "sign": -1},
                       "q1_rad": {"from": "shoulder", "unit": "deg", "sign": -1, "offset": 90.0}})


def test_the_line_keeps_column_and_unit_of_the_user():
    assert map_line(WHERE, "tau1_Nm", sign=-1) == "tau1_Nm: {from: M_shoulder, unit: N m, sign: -1}"
    assert map_line(WHERE, "tau1_Nm", "tau2_Nm") == 'tau1_Nm: {from: "M [elbow]", unit: N cm, sign: -1}'
    assert map_line(WHERE, "q1_rad", sign=-1) == "q1_rad: {from: shoulder, unit: deg, offset: -90}"
    assert map_line(WHERE, "q1_rad", period=2 * np.pi) == "q1_rad: {from: shoulder, unit: deg, sign: -1, offset: 90, period: 360}"


def test_a_unit_takes_the_place_of_none_or_si_and_else_is_a_factor():
    assert map_line(WHERE, "tau1_Nm", unit="N cm") == "tau1_Nm: {from: M_shoulder, unit: N cm}"
    assert map_line(WHERE, "tau2_Nm", unit="mN m") == 'tau2_Nm: {from: "M [elbow]", unit: N cm, scale: 0.001, sign: -1}'
    assert map_line(Origin(), "t_s", unit="ms") == "t_s: {from: t_s, unit: ms}"
    assert map_line(Origin(), "tau1_Nm", "tau2_Nm") == "tau1_Nm: tau2_Nm"


def test_the_place_says_that_a_line_is_replaced():
    assert mapping_text(WHERE, "tau1_Nm", sign=-1).endswith("columns.yaml or --map FILE, in place of the line of this name")
    assert mapping_text(Origin(), "tau1_Nm", sign=-1).endswith("columns.yaml or --map FILE")
    assert mapping_text(Origin(), "u0_m_s", True, unit="mm/s").startswith("'steady: {u0_m_s: {from: u0_m_s, unit: mm/s}}'")
    assert mapping_text(WHERE, "tau1_Nm", True, sign=-1).startswith("'tau1_Nm: {from: M_shoulder, unit: N m, sign: -1}' under 'steady:'")


@given(st.text(st.characters(exclude_categories=("C", "Zl", "Zp")), min_size=1, max_size=20))
def test_any_name_is_read_back_as_it_is(name: str):
    assert yaml.safe_load(f"{{from: {yaml_text(name)}}}") == {"from": name}


@pytest.mark.parametrize("changes", [{"sign": -1}, {"unit": "deg"}, {"scale": 2.5}])
@pytest.mark.parametrize("now", [{"from": "a"}, {"from": "a", "unit": "deg", "sign": -1, "offset": 90.0, "scale": 0.5}])
def test_the_line_changes_the_values_by_what_was_asked(tmp_path: Path, now: dict, changes: dict):
    (tmp_path / "arm.yaml").write_text(ARM_YAML)
    columns = {("a" if name == "q1_rad" else name): values for name, values in healthy().items()}
    write_csv(tmp_path / "run.csv", columns)

    def read(document: dict):
        mapping = parse_column_map({"columns": document}, "map")
        return read_recording(tmp_path / "run.csv", read_arm(tmp_path / "arm.yaml"), column_map=mapping)

    before = read({"q1_rad": now})
    after = read(yaml.safe_load(map_line(before.origin, "q1_rad", **changes)))
    times = {"sign": -1, "unit": np.pi / 180, "scale": 2.5}[next(iter(changes))]
    np.testing.assert_allclose(after.q[:, 0], times * before.q[:, 0], rtol=2e-5)
