"""URDF in: an arm that moves as MuJoCo moves the URDF."""

import numpy as np
import pytest
from campaigns import GIVEN
from rigs import arm
from robots import ALIGNED, ROBOT, compiled, inverse, random_states, written

import nnhydro
from nnhydro.cli.main import run
from nnhydro.deployment.formats.urdf import arm_yaml, read_urdf
from nnhydro.errors import ArmError
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Motion


@pytest.mark.parametrize("way", [1, -1])
def test_the_arm_of_a_urdf_moves_as_mujoco_moves_the_urdf(tmp_path, way):
    text = ALIGNED.format(way=way)
    found = read_urdf(written(tmp_path, text), density=0.0)
    assert found.arm.parallel_distance_m == pytest.approx(0.08)
    model = compiled(text)
    model.opt.gravity[:] = 0
    model.dof_damping[:], model.dof_frictionloss[:] = 0, 0
    q, qd, qdd = random_states(2)
    theirs = inverse(model, q, qd, qdd)
    sign, offset = np.array([1, way]), np.array([0, 0.7])
    ours = StripTheory(found.arm, GIVEN, {}, "rigid", Loads({"rigid_body": RigidBody.of_arm(found.arm)}))
    motion = Motion.at(sign * q + offset, sign * qd, sign * qdd)
    np.testing.assert_allclose(sign * ours.torque(motion).numpy(), theirs, rtol=1e-6, atol=1e-8)


def test_what_a_urdf_says_otherwise_is_told_as_it_has_to_be_typed(tmp_path):
    notes = " ".join(read_urdf(written(tmp_path, ROBOT.format(way=-1))).notes)
    assert "q2_rad: {from: elbow, unit: deg, sign: -1, offset: 40.1" in notes
    assert "joint 'elbow' states friction, taken as coulomb_Nm 0.2, viscous_Nm_s 0.1, known to 10 %" in notes
    assert "beside its line" in notes, "the hand is off the line"
    assert "known_to" in notes


def test_stated_friction_is_written_into_arm_yaml_and_read_back(tmp_path):
    found = read_urdf(written(tmp_path, ROBOT.format(way=1)))
    (tmp_path / "arm.yaml").write_text(arm_yaml(found.arm))
    again = nnhydro.read_arm(tmp_path / "arm.yaml")
    assert again == found.arm
    assert [(joint.coulomb, joint.viscous) for joint in again.friction] == [(None, None), (0.2, 0.1)]
    assert read_urdf(written(tmp_path, ROBOT.format(way=1).replace('damping="0.1" friction="0.2"', ""))).arm.friction is None


LEVEL = ALIGNED.format(way=1).replace('rpy="0.4 0 0"', 'rpy="{}"', 1)
FRAMES = {
    "level": ("0 0 0", "", None, None),
    "turned": ("0 0 1", "q1_rad: {from: shoulder, unit: deg, sign: 1, offset: 57.2958}", None, None),
    "upside down": ("3.141592653589793 0 0", "", "+X, from which q1 counts, is (1, 0, 0)", "(0, -1, 0)"),
    "upright": ("1.5707963267948966 0 0", "", "gravity_m_s2: 0.0, write 9.81 there", "is (0, 0, 1)"),
    "hanging": ("1.5707963267948966 1.5707963267948966 0", "q1_rad: {from: shoulder, unit: deg, sign: 1, offset: -90}", "write 9.81", None),
    "tilted": ("0.4 0 0", "", "write 3.82 there", None),
}


@pytest.mark.parametrize("mounted", FRAMES)
def test_frame_zero_and_weight_that_are_not_those_of_a_level_arm_are_told(tmp_path, mounted):
    rpy, entry, *said = FRAMES[mounted]
    notes = " ".join(read_urdf(written(tmp_path, LEVEL.format(rpy))).notes)
    assert ("q1_rad" in notes) == bool(entry)
    assert entry in notes
    assert ("gravity" in notes) == (mounted in ("upright", "hanging", "tilted"))
    assert ("+X" in notes) == (mounted not in ("level", "turned"))
    assert all(line in notes for line in said if line)


def test_lengths_diameters_and_masses_are_those_of_the_file(tmp_path):
    a = read_urdf(written(tmp_path, ALIGNED.format(way=1))).arm
    np.testing.assert_allclose(a.L, [0.55, 0.4])
    np.testing.assert_allclose(a.D, [0.07, 0.06])
    assert a.links[1].mass_kg == pytest.approx(1.1)
    assert a.links[1].com_m == pytest.approx((0.8 * 0.2 + 0.3 * 0.42) / 1.1)
    wide = read_urdf(written(tmp_path, ALIGNED.format(way=1)), diameters=(0.1, 0.2)).arm
    np.testing.assert_allclose(wide.D, [0.1, 0.2])


def test_the_written_arm_is_read_back_the_same(tmp_path):
    a = arm(drive={"kind": "remote", "angle2": "absolute"}, gravity_m_s2=9.81)
    (tmp_path / "arm.yaml").write_text(arm_yaml(a, ["a remark"]))
    assert nnhydro.read_arm(tmp_path / "arm.yaml") == a


def test_a_wrong_call_of_the_importer_is_refused(tmp_path):
    with pytest.raises(ArmError, match="1 given"):
        read_urdf(written(tmp_path, ALIGNED.format(way=1)), diameters=(0.1,))
    with pytest.raises(ArmError, match="cannot be read"):
        read_urdf(tmp_path / "gone.urdf")


def test_the_command_writes_an_arm_that_can_be_checked(tmp_path, capsys):
    path = written(tmp_path, ALIGNED.format(way=1))
    out = tmp_path / "campaign" / "arm.yaml"
    assert run(["arm", str(path), "--out", str(out)]) == 0
    assert "An arm of 2 links, 0.95 m long." in capsys.readouterr().out
    assert nnhydro.read_arm(out).name == "two link"
    for arguments, line in ((["--out", str(out)], "is there already"), (["--out", "x.json"], "ends in .yaml"),
                            (["--out", str(tmp_path / "b.yaml"), "--diameter", "thick"], "give numbers in metres")):
        assert run(["arm", str(path), *arguments]) == 2
        assert line in capsys.readouterr().err


def test_a_hand_beside_the_line_changes_nothing_but_the_note(tmp_path):
    bent = read_urdf(written(tmp_path, ROBOT.format(way=1))).arm
    straight = read_urdf(written(tmp_path, ALIGNED.format(way=1))).arm
    assert bent.links[0] == straight.links[0]
