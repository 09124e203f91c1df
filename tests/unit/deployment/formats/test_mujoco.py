"""URDF in, MuJoCo XML and curves out: held against MuJoCo itself, and against what was put in."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from campaigns import GIVEN, planted
from rigs import HOSTILE, arm
from robots import compiled, inverse, random_states

import nnhydro
from nnhydro.cli.main import run
from nnhydro.deployment.formats.mujoco import EXPORTED, mujoco_xml
from nnhydro.effects.catalogue import catalogue
from nnhydro.errors import ModelError
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import term_kinds
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.motion import Motion


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


def test_the_mujoco_xml_is_well_formed_and_holds_nothing_more():
    model = StripTheory(arm(2), GIVEN, {}, HOSTILE, planted(arm(2)))
    made, plain = (ET.fromstring(mujoco_xml(m).xml) for m in (model, replace(model, name="constant")))
    assert [e.tag for e in made.iter()] == [e.tag for e in plain.iter()]
