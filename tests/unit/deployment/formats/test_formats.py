"""URDF in, MuJoCo XML and curves out: held against MuJoCo itself, and against what was put in."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted
from rigs import arm

import nnhydro
from nnhydro.cli.main import run
from nnhydro.deployment.formats.curves import coefficient_rows
from nnhydro.deployment.formats.mujoco import EXPORTED, mujoco_xml
from nnhydro.deployment.formats.urdf import arm_yaml, read_urdf
from nnhydro.effects.catalogue import catalogue
from nnhydro.errors import ArmError, ConfigError, ModelError
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import term_kinds
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.motion import Motion
from nnhydro.physics.travel.state_model import added_mass_curve, drag_curve, state_loads

ROBOT = """<robot name="two link">
  <link name="base"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0.3 0.1 0.2" rpy="0.4 0 0"/><axis xyz="0 0 1"/><limit effort="1" velocity="1"/></joint>
  <link name="upper">
    <inertial><origin xyz="0.2 0 0.01" rpy="0.3 0.2 0.1"/><mass value="1.1"/>
      <inertia ixx="0.010" iyy="0.03" izz="0.028" ixy="0.001" ixz="0" iyz="0.0005"/></inertial>
    <collision><origin xyz="0.25 0 0" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.035" length="0.5"/></geometry></collision>
  </link>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.55 0 0.08" rpy="0 0 0.7"/><axis xyz="0 0 {way}"/><dynamics damping="0.1" friction="0.2"/></joint>
  <link name="fore">
    <inertial><origin xyz="0.2 0 0"/><mass value="0.8"/><inertia ixx="0.001" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.2 0 0" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.03" length="0.4"/></geometry></collision>
  </link>
  <joint name="flange" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="0.4 0 0" rpy="0 0 0.5"/></joint>
  <link name="hand">
    <inertial><origin xyz="0.02 0 0"/><mass value="0.3"/><inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
</robot>
"""
ALIGNED = ROBOT.replace('rpy="0 0 0.5"', 'rpy="0 0 0"')  # with the hand in line, the arm is exactly planar: no mass lies beside a link


def written(tmp_path, text):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    return path


def inverse(model, q, qd, qdd):
    """MuJoCo's joint torques (n, joints) at unrelated states."""
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed: pip install 'nnhydro[test]'")
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data, found = mujoco.MjData(model), []
    for row in zip(q, qd, qdd, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = row
        mujoco.mj_inverse(model, data)
        found.append(data.qfrc_inverse.copy())
    return np.array(found)


def compiled(xml):
    """The text as MuJoCo reads it."""
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed: pip install 'nnhydro[test]'")
    return mujoco.MjModel.from_xml_string(xml)


def random_states(links, rows=40, seed=3):
    rng = np.random.default_rng(seed)
    return rng.uniform(-3, 3, (rows, links)), rng.choice([-1, 1], (rows, links)) * rng.uniform(0.5, 2, (rows, links)), \
        4 * rng.standard_normal((rows, links))


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
    assert "damping 0.1, friction 0.2" in notes
    assert "beside its line" in notes, "the hand is off the line"
    assert "known_to" in notes


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


@pytest.mark.parametrize(("change", "line"), [
    (("robot", "mujoco"), "outermost element is"),
    (('<link name="base"/>', '<link name="base"/><link name="other"/>'), "2 root links"),
    (("</robot>", ""), "not valid XML"), (("<robot name=\"two link\">", "<!DOCTYPE x [<!ENTITY a 'b'>]><robot>"), "declares entities"),
    (('<cylinder radius="0.03" length="0.4"/>', '<box size="1 1 1"/>'), "diameter is unknown"),
    (('<axis xyz="0 0 1"/><limit', '<axis xyz="0 1 0"/><limit'), "turns about another axis"),
    (('<mass value="1.1"/>', '<mass value="heavy"/>'), "'heavy' is not 1 finite"),
    (('<mass value="1.1"/>', '<mass value="0"/>'), "has no mass"),
    (('<parent link="upper"/>', ""), "no parent or child"), (('<child link="fore"/>', '<child link="gone"/>'), "2 root links"),
    (('type="fixed"', 'type="revolute"'), "turns about another axis"), (("revolute", "prismatic"), "no revolute joint"),
    (('<parent link="upper"/><child link="fore"/>', '<parent link="base"/><child link="fore"/>'), "side by side"),
])
def test_a_urdf_that_is_no_planar_arm_is_refused_with_what_mends_it(tmp_path, change, line):
    text = ALIGNED.format(way=1)
    assert change[0] in text
    with pytest.raises(ArmError, match=line) as error:
        read_urdf(written(tmp_path, text.replace(*change)))
    assert "\n" not in str(error.value)


def test_a_wrong_call_of_the_importer_is_refused(tmp_path):
    with pytest.raises(ArmError, match="1 given"):
        read_urdf(written(tmp_path, ALIGNED.format(way=1)), diameters=(0.1,))
    with pytest.raises(ArmError, match="cannot be read"):
        read_urdf(tmp_path / "gone.urdf")


def dry_machine():
    """An upright dry arm with everything at its joints that MuJoCo can hold."""
    a, known = arm(density=0.0, gravity_m_s2=9.81), catalogue()
    loads = Loads({"rigid_body": RigidBody.of_arm(a), "viscous_friction": ViscousTerm((0.3, 0.1)),
                   "coulomb_friction": CoulombTerm((0.5, 0.2)), "rotor": known["rotor_inertia"](inertia=(0.04,), joint=2),
                   "hose": known["umbilical_stiffness"](stiffness=(0.6,), preload=(-0.3,), quadratic=(), cubic=(), joint=1),
                   "load": known["payload_mass"](mass=(0.4,), beyond=(0.03,))})
    return StripTheory(a, GIVEN, {}, "machine", loads)


def test_mujoco_moves_the_exported_machine_with_the_same_torques():
    model = dry_machine()
    made = mujoco_xml(model)
    q, qd, qdd = random_states(2)
    theirs = inverse(compiled(made.xml), q, qd, qdd)
    ours = model.torque(Motion.at(q, qd, qdd)).numpy()
    np.testing.assert_allclose(theirs, ours, rtol=2e-4, atol=2e-4)  # MuJoCo's dry friction is a soft constraint
    assert len(made.holds) == 6


def test_a_hose_that_bends_is_held_by_its_stiffness_at_rest_and_that_is_said():
    model = dry_machine()
    bent = replace(model.loads.terms["hose"], cubic=(0.2,), quadratic=(0.0,))
    made = mujoco_xml(replace(model, loads=Loads({**model.loads.terms, "hose": bent})))
    k, rest = (bent.quantities()[name].value for name in ("stiffness", "rest_angle"))
    assert k == pytest.approx(0.6 + 3 * 0.2 * rest**2)
    assert f'stiffness="{k:.9g}"' in made.xml
    assert any("spring is linear" in line for line in made.lacks)


def test_dry_friction_that_bends_before_it_slips_is_said_to_lack_that():
    model, rubs = dry_machine(), catalogue()["coulomb_friction"](level=(0.2,), joint=1)
    made = [mujoco_xml(replace(model, loads=Loads({"rubs": replace(rubs, bending=b), "body": model.loads.terms["rigid_body"]})))
            for b in ((), (0.012,))]
    assert [exported.xml.count('frictionloss="0.2"') for exported in made] == [1, 1]
    assert [sum("does not bend" in line for line in exported.lacks) for exported in made] == [0, 1]


@pytest.mark.parametrize("links", [1, 2, 3])
def test_a_straight_arm_under_tow_feels_the_drag_that_was_identified(links):
    a = arm(links)
    drag = NormalDrag((1.1, 0.8, 0.6)[:links])
    model = StripTheory(a, GIVEN, {}, "drag", Loads({"rigid_body": RigidBody.of_arm(a), "normal_drag": drag}))
    made = mujoco_xml(model)
    still = np.zeros((1, links))
    theirs = compiled(made.xml.replace("<option ", '<option wind="0 -0.7 0" '))
    ours = model.torque(Motion.at(still, 0.0, 0.0, 0.7)).numpy()
    np.testing.assert_allclose(inverse(theirs, still, still, still), ours, rtol=1e-6)


def test_what_mujoco_cannot_hold_is_said_in_the_file_and_by_the_command(tmp_path, capsys):
    a = arm()
    model = nnhydro.load_model(save(StripTheory(a, GIVEN, {}, "constant", planted(a)), tmp_path / "m"))
    lacks = model.export(tmp_path / "arm.xml")
    text = (tmp_path / "arm.xml").read_text()
    assert any("added_mass" in line for line in lacks)
    assert all(line.replace("--", "- -") in text for line in lacks)
    assert run(["export", str(tmp_path / "m"), "--format", "mujoco", "--out", str(tmp_path / "again.xml")]) == 0
    assert "cannot hold  added_mass" in capsys.readouterr().out
    assert (tmp_path / "again.xml").read_text() == text
    compiled(text)


def save(model, folder):
    from nnhydro.models.storage import save_model
    return save_model(model, folder)


def test_every_term_is_either_held_by_mujoco_or_named_as_missing():
    a = arm()
    for kind, cls in term_kinds().items():
        if kind in ("rigid_body",) or not hasattr(cls, "started"):
            continue
        made = mujoco_xml(StripTheory(a, GIVEN, {}, "x", Loads({"rigid_body": RigidBody.of_arm(a), "one": cls.at_start(a)})))
        told = made.holds if kind in EXPORTED else made.lacks
        assert any(line.startswith("one:") for line in told), kind


def test_a_model_without_parameters_or_masses_is_refused():
    a = arm()
    massless = a.model_copy(update={"links": tuple(link.model_copy(update={"mass_kg": 0.0}) for link in a.links)})
    with pytest.raises(ModelError, match="no mass"):
        mujoco_xml(StripTheory(massless, GIVEN, {}, "x", Loads({"rigid_body": RigidBody.of_arm(massless)})))
    with pytest.raises(ModelError, match="no rigid body"):
        mujoco_xml(StripTheory(a, GIVEN, {}, "x", Loads({})))


def test_the_curves_are_those_of_the_model(tmp_path):
    a = arm()
    model = StripTheory(a, GIVEN, {}, "state", state_loads(a))
    rows = np.array(list(coefficient_rows(model)))
    for link in range(2):
        own = rows[rows[:, 1] == link + 1]
        s = torch.tensor(own[:, 0])
        np.testing.assert_allclose(own[:, 2], drag_curve(model.loads, s, link))
        np.testing.assert_allclose(own[:, 3], added_mass_curve(model.loads, s, link))
    level = np.array(list(coefficient_rows(StripTheory(a, GIVEN, {}, "constant", planted(a)))))
    assert set(level[level[:, 1] == 2][:, 2]) == {1.3}
    assert nnhydro.load_model(save(model, tmp_path / "m")).export(tmp_path / "c.csv") == ()
    assert (tmp_path / "c.csv").read_text().splitlines()[0] == "s_over_D,link,C_D,C_M"
    with pytest.raises(ConfigError, match=r"\.onnx, \.xml or \.csv"):
        nnhydro.load_model(tmp_path / "m").export(tmp_path / "c.txt")


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
