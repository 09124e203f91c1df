"""Friction at the joints opposes their relative rotation and has the sizes of the document."""

from dataclasses import replace
from math import atanh, pi

import numpy as np
import pytest
import torch
from rigs import arm, assert_close

from nnhydro.effects.catalogue import catalogue
from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow
from nnhydro.physics.joints import DRY_WIDTH
from nnhydro.physics.load_term import term_of
from nnhydro.physics.loads.bearing_friction import BearingFriction, bearing_torque
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.loaded_bearing import LoadedBearing, load_torque
from nnhydro.physics.loads.rotor_inertia import RotorTerm
from nnhydro.physics.loads.seal_friction import SealFriction, seal_torque
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.motion import Motion, tensor
from nnhydro.simulation.recipe.true_loads import true_loads

FRICTION = (BearingFriction, CoulombTerm, LoadedBearing, SealFriction, ViscousTerm)


def friction_torque(term, qd, **motion):
    a = arm(len(qd))
    return term.torque(Flow(a, Motion.at([[0.4] * len(qd)], [qd], 0.0, **motion)))


@pytest.mark.parametrize("law", FRICTION)
def test_the_drive_must_supply_friction_with_the_sign_of_the_joints_own_rate(law):
    tau = friction_torque(law.at_start(arm(3)), [1.0, -2.0, 0.0])
    assert (torch.sign(tau) == tensor([[1.0, -1.0, 0.0]])).all()


@pytest.mark.parametrize("law", FRICTION)
def test_friction_knows_nothing_of_the_carriage_or_the_water(law):
    term = law.at_start(arm(2))
    assert torch.equal(friction_torque(term, [1.0, -2.0], u0=2.0), friction_torque(term, [1.0, -2.0]))


def test_coulomb_friction_is_constant_once_the_joint_turns():
    term = CoulombTerm((0.3,), v0_rad_s=0.02)
    assert_close(friction_torque(term, [0.5]), tensor([[0.3]]))
    assert_close(friction_torque(term, [-3.0]), tensor([[-0.3]]))
    assert_close(friction_torque(term, [0.02 * atanh(0.5)]), tensor([[0.15]]))


@pytest.mark.parametrize("bending", [(), (0.02,)])
def test_the_hypothesis_of_coulomb_friction_is_the_load_term_at_its_joint(bending):
    t = np.linspace(0.0, 4.0, 200)
    states = Motion.at(0.3 * np.sin([3 * t, 2 * t]).T, [[0.9, 0.6]] * np.cos([3 * t, 2 * t]).T, 0.0)
    flow = Flow(arm(2), replace(states, t=tensor(t), steady=False))
    found = catalogue()["coulomb_friction"](joint=2, level=(0.3,), bending=bending)
    term = CoulombTerm((0.0, 0.3), DRY_WIDTH, sum(bending))
    assert torch.equal(found.torque(flow), term.torque(flow))
    assert torch.equal(term.torque(flow)[:, 0], torch.zeros(200, dtype=torch.float64))
    assert term.torque(flow)[:, 1].abs().max() > 0.29
    assert (term.torque(flow)[0, 1] == 0.0) == bool(bending), "a contact is unbent at first"


def test_viscous_friction_is_proportional_to_the_rate():
    assert_close(friction_torque(ViscousTerm((0.3, 0.5)), [2.0, -4.0]), tensor([[0.6, -2.0]]))


def test_a_bearing_changes_branch_where_viscosity_times_speed_is_2000():
    slow, just_below, just_above, fast = (float(bearing_torque(2.0, 30.0, 30.0, tensor(n))) for n in (1.0, 66.6, 66.7, 66.7 * 8))
    assert slow == just_below == pytest.approx(160e-10 * 2.0 * 30**3)
    assert just_above == pytest.approx(just_below, rel=0.01)
    assert fast == pytest.approx(4 * just_above)


def test_the_bearing_term_reads_its_speed_in_rpm():
    rate = 250 * 2 * pi / 60
    assert_close(friction_torque(BearingFriction((2.0,)), [-rate]), tensor([[-0.0020690354674625933]]))


def test_a_bearings_slope_at_rest_is_finite():
    qd = torch.zeros(1, 1, dtype=torch.float64, requires_grad=True)
    nothing = torch.zeros(1, dtype=torch.float64)
    motion = Motion(nothing, torch.zeros(1, 1, dtype=torch.float64), qd, torch.zeros(1, 1, dtype=torch.float64), nothing, nothing)
    BearingFriction((2.0,)).torque(Flow(arm(1), motion)).sum().backward()
    assert torch.isfinite(qd.grad).all()
    assert qd.grad.item() > 0


def test_the_terms_give_the_magnitudes_of_the_plain_formulas():
    assert_close(friction_torque(SealFriction((0.5,)), [1.0]), tensor([[seal_torque(0.5, 80.0, 0.01, 2)]]))
    assert_close(friction_torque(LoadedBearing((3e-4,)), [1.0]), tensor([[load_torque(3e-4, 0.4, 50.0, 2500.0, 0.03)]]))
    assert 0.02 < seal_torque(0.5, 80.0, 0.01, 2) < 0.08


@pytest.mark.parametrize(("law", "option", "value"), [
    (CoulombTerm, "v0_rad_s", 0.0), (BearingFriction, "viscosity_m2_s", -1e-6), (LoadedBearing, "capacity_N", float("nan")),
    (SealFriction, "lips", "two")])
def test_an_option_that_makes_no_sense_is_refused_by_name(law, option, value):
    with pytest.raises(ModelError, match=f"{option} = .* (must be a number above 0|is not a finite number)"):
        law((1.0,), **{option: value})


def test_files_of_earlier_versions_are_read_by_their_names():
    viscous = {"kind": "viscous_friction", "parameters": {"b": [0.3, 0.5]}}
    recipe = {"viscous_friction": {"b": [0.3, 0.5]}, "drive_inertia": {"inertia": 0.1}}
    loads = true_loads(recipe, arm(2), "recipe").terms
    assert term_of(viscous) == ViscousTerm((0.3, 0.5)) == loads["viscous_friction"]
    inertia = {"kind": "drive_inertia", "parameters": {"inertia": [0.1, 0.1]}}
    assert term_of(inertia) == RotorTerm((0.1, 0.1)) == loads["drive_inertia"]


def test_the_bearing_turns_from_its_constant_to_its_growing_law_where_both_agree():
    n = torch.tensor([0.0, 1.0, 60.0, 2000 / 30 - 1e-9, 2000 / 30 + 1e-9, 500.0], dtype=torch.float64)
    told = bearing_torque(2.0, 30.0, 30.0, n).numpy()
    low = 160e-10 * 2 * 30**3
    np.testing.assert_allclose(told[:4], low)
    np.testing.assert_allclose(told[4:], [1e-10 * 2 * 30**3 * (30 * x) ** (2 / 3) for x in (2000 / 30, 500.0)], rtol=1e-6)
