"""Foreign names and units become ours; what cannot be understood is refused with what was probably meant."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planted import healthy, line_of, recording, the_arm, write_campaign, write_csv

from nnhydro.errors import ConfigError, RecordingError
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.readers.column_map import parse_column_map, read_column_map
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.readers.units import TARGETS, UNITS, factor

ARM = the_arm()
WANT = healthy(rows=40)
MAP = """columns:
  t_s: {from: "Time (ms)", unit: ms}
  q1_rad: {from: shoulder, unit: deg, sign: -1, offset: 90}
  q2_rad: {from: elbow, unit: rev}
  dq1_rad_s: {from: "rate 1", unit: rpm}
  dq2_rad_s: {from: "rate 2", unit: deg/s}
  tau1_Nm: {from: T1, unit: lbf in}
  tau2_Nm: {from: T2, unit: N mm}
"""


def foreign() -> dict[str, np.ndarray]:
    return {"Time (ms)": WANT["t_s"] * 1e3, "shoulder": 90 - np.degrees(WANT["q1_rad"]), "elbow": WANT["q2_rad"] / (2 * np.pi),
            "rate 1": WANT["dq1_rad_s"] * 60 / (2 * np.pi), "rate 2": np.degrees(WANT["dq2_rad_s"]),
            "T1": WANT["tau1_Nm"] / 0.1129848290276167, "T2": WANT["tau2_Nm"] * 1e3}


@pytest.mark.parametrize(("unit", "target", "value"), [
    ("deg", "q1_rad", math.pi / 180), ("°", "q2_rad", math.pi / 180), ("rev", "q1_rad", 2 * math.pi), ("ms", "t_s", 1e-3),
    ("µs", "t_s", 1e-6),
    ("rpm", "dq1_rad_s", 0.10471975511965977), ("deg/s", "dq1_rad_s", math.pi / 180), ("degrees/s", "dq1_rad_s", math.pi / 180),
    ("rad/s²", "ddq1_rad_s2", 1), ("N mm", "tau1_Nm", 1e-3), ("Nmm", "tau1_Nm", 1e-3), ("N·m", "tau1_Nm", 1), ("kgf m", "tau1_Nm", 9.80665),
    ("lbf ft", "tau1_Nm", 1.3558179483314004), ("ft-lb", "tau1_Nm", 1.3558179483314004), ("lbf in", "tau2_Nm", 0.1129848290276167),
    ("ozf in", "tau1_Nm", 0.007061551814226044), ("oz-in", "tau1_Nm", 0.007061551814226044), ("mm/s", "u0_m_s", 1e-3),
    ("cm/s", "u0_m_s", 1e-2),
    ("kn", "u0_m_s", 0.5144444444444445), ("g", "du0_m_s2", 9.80665),
])
def test_units_are_what_the_standards_say(unit: str, target: str, value: float):
    assert factor(unit, target) == pytest.approx(value, rel=1e-12)


def test_every_channel_has_units_and_its_own_is_one():
    for target, suffix in TARGETS.items():
        assert 1.0 in UNITS[suffix].values(), target


def test_a_mapped_file_gives_the_recording_in_si(tmp_path: Path):
    write_csv(tmp_path / "a.csv", foreign())
    (tmp_path / "map.yaml").write_text(MAP)
    r, want = read_recording(tmp_path / "a.csv", ARM, column_map=read_column_map(tmp_path / "map.yaml")), recording(WANT)
    for name in ("t", "q", "qd", "tau"):
        np.testing.assert_allclose(getattr(r, name), getattr(want, name), rtol=1e-12, atol=1e-12)
    assert any("map.yaml" in step for step in r.steps)


def test_a_line_that_a_message_gives_may_stand_as_it_is(tmp_path: Path):
    """`check` says: 'q1_rad: {from: shoulder, unit: deg}' in columns.yaml."""
    where = tmp_path / "map.yaml"
    where.write_text(MAP)
    below = read_column_map(where)
    first, *lines = MAP.splitlines()
    where.write_text("\n".join([*(line[2:] for line in lines[:3]), first, *lines[3:]]))
    assert read_column_map(where).settings == below.settings
    where.write_text(MAP + "t_s: seconds\n")
    with pytest.raises(ConfigError, match="'t_s' is mapped twice"):
        read_column_map(where)


def test_a_mapping_in_the_campaign_is_found_and_one_given_takes_its_place(tmp_path: Path):
    root = write_campaign(tmp_path / "c")
    for name in ("recordings/run1.csv", "recordings/run2.csv", "unseen/next.csv"):
        write_csv(root / name, foreign())
    (root / "columns.yaml").write_text(MAP)
    found = open_campaign(root)
    np.testing.assert_allclose(found.load("run1").q[:, 0], WANT["q1_rad"], atol=1e-12)
    np.testing.assert_allclose(read_recording(root / "unseen/next.csv", ARM, torque=False).q[:, 1], WANT["q2_rad"], atol=1e-12)
    (tmp_path / "other.yaml").write_text(MAP.replace("sign: -1, offset: 90", "sign: -1, offset: 0"))
    other = open_campaign(root, tmp_path / "other.yaml")
    np.testing.assert_allclose(other.load("run1").q[:, 0], WANT["q1_rad"] - np.pi / 2, atol=1e-12)
    assert found.sha256() != other.sha256()


def test_steady_tables_have_a_mapping_of_their_own(tmp_path: Path):
    root = write_campaign(tmp_path / "c")
    (root / "steady").mkdir()
    (root / "steady" / "tow.csv").write_text("run,a,b,u0_m_s,T1,T2\nx,90,0,0.3,1000,500\n")
    columns = {"q1_rad": ("a", "deg"), "q2_rad": ("b", "deg"), "tau1_Nm": ("T1", "N mm"), "tau2_Nm": ("T2", "N mm")}
    lines = "".join(f"  {target}: {{from: {name}, unit: {unit}}}\n" for target, (name, unit) in columns.items())
    (root / "columns.yaml").write_text("steady:\n" + lines)
    table = open_campaign(root).steady[0]
    assert table.q[0, 0] == pytest.approx(math.pi / 2)
    assert table.tau[0].tolist() == [1.0, 0.5]


def test_two_swapped_columns_can_be_swapped_back(tmp_path: Path):
    write_csv(tmp_path / "a.csv", WANT)
    swap = parse_column_map({"columns": {"tau1_Nm": "tau2_Nm", "tau2_Nm": {"from": "tau1_Nm", "sign": -1}}}, "map")
    tau = read_recording(tmp_path / "a.csv", ARM, column_map=swap).tau
    assert tau is not None
    np.testing.assert_array_equal(tau, np.column_stack([WANT["tau2_Nm"], -WANT["tau1_Nm"]]))


@pytest.mark.parametrize(("columns", "line"), [
    ({"q1_deg": "a"}, "'q1_deg' is not a channel: did you mean 'q1_rad'"),
    ({"speed": "a"}, "'speed' is not a channel: channels are called t_s"),
    ({"q1_rad": {"from": "a", "unit": "gon"}}, "unit 'gon' for q1_rad is unknown.*known are rad, mrad, deg"),
    ({"q1_rad": {"from": "a", "unit": "degre"}}, "did you mean 'deg'"),
    ({"tau1_Nm": {"from": "a", "unit": "deg"}}, "unit 'deg' for tau1_Nm is a unit of another quantity: known are N m"),
    ({"q1_rad": {"form": "a"}}, "unknown key 'columns.q1_rad.form': did you mean 'from'"),
    ({"q1_rad": {"unit": "deg"}}, "key 'columns.q1_rad.from' is missing"),
    ({"q1_rad": {"from": "a", "sign": 2}}, "sign"),
    ({"q1_rad": {"from": "a", "scale": 0}}, "wipe the channel out"),
])
def test_a_faulty_mapping_is_refused_with_what_was_meant(columns: dict, line: str):
    with pytest.raises(ConfigError, match=line):
        parse_column_map({"columns": columns}, "map.yaml")


@pytest.mark.parametrize(("columns", "line"), [
    ({"q1_rad": "q1_radd"}, "column 'q1_radd', mapped to q1_rad, is not there: did you mean 'q1_rad'"),
    ({"q1_rad": "q2_rad"}, "has a column 'q1_rad' already, but the mapping takes it from 'q2_rad'"),
])
def test_a_mapping_that_does_not_fit_the_file_is_refused(tmp_path: Path, columns: dict, line: str):
    write_csv(tmp_path / "a.csv", WANT)
    with pytest.raises(RecordingError, match=line):
        read_recording(tmp_path / "a.csv", ARM, column_map=parse_column_map({"columns": columns}, "map"))


SOURCE = st.one_of(st.text(max_size=8), st.integers(), st.none(), st.dictionaries(
    st.sampled_from(["from", "unit", "sign", "offset", "scale", "x"]),
    st.one_of(st.sampled_from(["q1_rad", "t_s", "deg", "rpm", "N m", "lbf in"]), st.text(max_size=6), st.floats(), st.none())))
TARGET = st.one_of(st.sampled_from(["t_s", "q1_rad", "tau1_Nm", "dq1_rad_s"]), st.text(max_size=6))
ENTRIES = st.dictionaries(TARGET, SOURCE, max_size=4)
SECTION = st.sampled_from(["columns", "steady", "joints", "topic", "colums"])


@settings(max_examples=40, derandomize=True, deadline=None)
@given(st.dictionaries(SECTION, st.one_of(ENTRIES, SOURCE, st.lists(SOURCE, max_size=3))))
def test_any_mapping_gives_a_recording_or_one_line(tmp_path_factory, document: dict):
    path = tmp_path_factory.mktemp("map") / "a.csv"
    write_csv(path, WANT)
    line = line_of(lambda: read_recording(path, ARM, column_map=parse_column_map(document, "map.yaml")))
    assert line is None or ("\n" not in line and ("map.yaml" in line or "a.csv" in line))
