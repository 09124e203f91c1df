"""The arm as arm.yaml states it."""

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from planted import line_of
from rigs import LINKS, arm

from nnhydro.errors import ArmError
from nnhydro.recordings.arm import Arm, parse_arm, read_arm

FEW = settings(max_examples=60, derandomize=True, deadline=None)
VALUE = st.recursive(st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=10)),
                     lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3), max_leaves=8)
KEYS = st.sampled_from(["schema", "name", "fluid", "links", "drive", "gear", "gravity_m_s2", "density_kg_m3", "linsk", "kind"])


@FEW
@given(st.dictionaries(KEYS, VALUE, max_size=6))
def test_any_arm_document_gives_an_arm_or_one_line(document: dict):
    line = line_of(lambda: parse_arm(document, "arm.yaml"))
    assert line is None or (line.startswith("arm.yaml: ") and "\n" not in line)


def changed(**keys):
    return parse_arm({**arm(2).document(), **keys}, "arm.yaml")


@pytest.mark.parametrize(("keys", "line"), [
    ({"drive": {"kind": "direct", "pulley_ratio": 2.0}}, "belong to a belt"), ({"name": "two\nlines"}, "line break"),
    ({"friction": [{"coulomb_Nm": 0.1}]}, "friction has 1 entry for 2 joints"),
    ({"friction": [{"coulomb_N": 0.1}, {}]}, "coulomb_Nm"), ({"joints": [{"type": "prismatic"}, {}]}, "must be the only one")])
def test_what_is_no_arm_is_refused_with_the_remedy(keys, line):
    with pytest.raises(ArmError, match=line):
        changed(**keys)


def test_a_belt_is_for_two_links():
    belt = {"kind": "remote", "pulley_ratio": 1.5, "angle2": "absolute"}
    assert changed(drive=belt).drive.pulley_ratio == 1.5
    assert changed(drive="remote").drive.kind == "remote"
    with pytest.raises(ArmError, match="defined for two links"):
        parse_arm({**arm(3).document(), "drive": belt}, "arm.yaml")


def test_the_gear_of_a_link_goes_before_that_of_the_arm():
    links = [{**LINKS[0], "gear": {"ratio": 5.0}}, LINKS[1]]
    geared = Arm.model_validate({"fluid": {"density_kg_m3": 0.0}, "gear": {"ratio": 2.0}, "links": links})
    assert [geared.gear_of(joint).ratio for joint in (0, 1)] == [5.0, 2.0]
    assert arm(1).gear_of(0).ratio == 1.0
    assert geared.dry


def test_the_document_of_an_arm_is_the_arm(tmp_path):
    made = changed(friction=[{"coulomb_Nm": 0.1}, {"viscous_Nm_s": 0.2}], gravity_m_s2=9.81)
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump(made.document()))
    assert read_arm(tmp_path / "arm.yaml") == made
    assert (made.friction[0].coulomb, made.friction[0].viscous, made.friction[1].viscous) == (0.1, None, 0.2)
