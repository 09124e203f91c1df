"""Torques in another unit are told by the physics, with the line that maps them; nobody else is accused."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import campaign, dry, planted
from rigs import arm

from nnhydro.fitting.physical_survey import denied_channels, judged_units, survey_with_physics, torque_unit
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.survey import survey

A = arm(2)


def whole(a=A, loads=None):
    return campaign(a, (planted(a) if loads is None else loads).plus("c", CoulombTerm((0.2, 0.1)[:a.n_links])), 3, noise=0.05,
                    seconds=4.0, rate=50.0)


def written_in(unit, c):
    return Campaign.of(c.arm, [replace(r, tau=r.tau / unit) for r in c.recordings()])


@pytest.mark.parametrize(("unit", "name"), [(1e-3, "mN m"), (1e-2, "N cm"), (1e3, "kN m"), (9.80665, "kgf m"),
                                           (0.1129848, "lbf in or kgf cm")])
def test_the_unit_of_the_torques_is_told(unit, name):
    c = written_in(unit, whole())
    found = torque_unit(c, c.plan())
    assert f"seem to be in {name}" in found.what
    first = name.partition(" or ")[0]
    assert f"'tau1_Nm: {{from: tau1_Nm, unit: {first}}}'" in found.remedy


def test_the_unit_is_mapped_with_a_line_for_every_joint():
    c = written_in(1e-2, whole())
    remedy = torque_unit(c, c.plan()).remedy
    assert "'tau1_Nm: {from: tau1_Nm, unit: N cm}', 'tau2_Nm: {from: tau2_Nm, unit: N cm}'" in remedy


@pytest.mark.parametrize("a", [A, arm(1), arm(2, 0.0, gravity_m_s2=9.81)], ids=["two links", "one link", "in air, upright"])
def test_torques_in_newton_metres_are_left_alone(a):
    c = whole(a, dry(a) if a.dry else None)
    assert torque_unit(c, c.plan()) is None


def test_a_joint_of_which_friction_is_nearly_all_is_left_alone():
    """The first joint of a service robot: 29 N m s/rad and 2 N m against an inertia of 2 kg m^2 at 0.3 rad/s."""
    a = arm(1, 0.0, gravity_m_s2=0.0)
    rubbing = dry(a).plus("o", ViscousTerm((29.0,))).plus("c", CoulombTerm((2.0,)))
    c = campaign(a, rubbing, 3, noise=0.1, seconds=8.0, rate=50.0, highest=0.3)
    assert torque_unit(c, c.plan()) is None


def test_a_unit_that_the_user_states_is_trusted():
    c = written_in(1e-3, whole())
    stated = Campaign.of(A, [replace(r, origin=replace(r.origin, stated={"tau1_Nm": "N m"})) for r in c.recordings()])
    assert torque_unit(stated, c.plan()) is None


def test_torques_that_no_unit_explains_accuse_nobody():
    c = whole()
    odd = Campaign.of(A, [replace(r, tau=300 * r.tau[::-1]) for r in c.recordings()])
    assert torque_unit(odd, c.plan()) is None


def test_a_unit_changes_the_likelihood_by_its_jacobian_alone():
    """The same campaign in mN m gives the likelihood of mN m that it gave of N m, but for the width of the numbers themselves."""
    c = whole()
    here, there = judged_units(c, c.plan()), judged_units(written_in(1e-3, c), c.plan())
    assert there["mN m"].error == pytest.approx(here[""].error, rel=1e-6)
    assert there["mN m"].likelihood > there[""].likelihood + 100
    assert here[""].likelihood > here["mN m"].likelihood + 100


def test_check_says_it_once():
    c = written_in(1e-3, whole(arm(1)))
    assert [oddity.check for oddity in survey_with_physics(c).oddities if oddity.severity == "warning"] == ["torque_unit"]


def test_energy_does_not_overrule_signs_that_the_physics_confirms():
    """An arm in air that is lowered gives energy to its drive in every recording, and the sign is right."""
    a = arm(1, 0.0, gravity_m_s2=9.81)
    lowered = [_lowered(r) for r in whole(a, dry(a)).recordings()]
    c = Campaign.of(a, lowered)
    assert "torque_sign" in {oddity.check for oddity in survey(c).oddities}
    assert "torque_sign" not in {oddity.check for oddity in survey_with_physics(c).oddities}


def _lowered(r, rows=40):
    """The rows over which the drive gains most."""
    gained = np.concatenate([[0.0], np.cumsum(r.tau[1:, 0] * np.diff(r.q[:, 0]))])
    first = int(np.argmin(gained[rows:] - gained[:-rows]))
    part = slice(first, first + rows)
    return replace(r, t=r.t[part], q=r.q[part], qd=r.qd[part], qdd=r.qdd[part], tau=r.tau[part], u0=None, du0=None)


def test_signs_that_physics_denies_are_named_before_any_result():
    c = whole()
    negated = Campaign.of(A, [replace(r, tau=-r.tau) for r in c.recordings()])
    assert denied_channels(c) == []
    assert denied_channels(negated, explained=True) == []
    (said,) = denied_channels(negated)
    assert said.startswith("tau1_Nm, tau2_Nm: the torques of joints 1 and 2 have the wrong sign")
    assert "columns.yaml" not in said
