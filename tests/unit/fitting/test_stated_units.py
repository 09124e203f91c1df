"""A unit that the user states is taken as given where it is possible, and named where physics denies it."""

from dataclasses import replace

import pytest
from campaigns import campaign, planted
from rigs import arm

from nnhydro.fitting.physical_survey import survey_with_physics
from nnhydro.fitting.stated_units import stated_units
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.recordings.campaign import Campaign

A = arm(2)


def whole():
    return campaign(A, planted(A).plus("c", CoulombTerm((0.2, 0.1))), 3, noise=0.05, seconds=4.0, rate=50.0)


def changed(c, stated, **factors):
    """The campaign with channels times a factor each, though `stated` says in which units they are."""
    def read(r):
        channels = {name: factor * getattr(r, name) for name, factor in factors.items()}
        return replace(r, **channels, qd=None, qdd=None, origin=replace(r.origin, stated=stated))
    return Campaign.of(A, [read(r) for r in c.recordings()])


def torques(unit):
    return {"tau1_Nm": unit, "tau2_Nm": unit}


@pytest.mark.parametrize(("stated", "factors", "words"), [
    (torques("N cm"), {"tau": 1e-2}, ("tau1_Nm, tau2_Nm", "stated unit N cm", "unit: N m'")),
    (torques("N m"), {"tau": 1e3}, ("tau1_Nm, tau2_Nm", "stated unit N m:", "unit: mN m'")),
    ({"q1_rad": "deg", "q2_rad": "deg"}, {"q": 3.14159 / 180}, ("q1_rad, q2_rad", "stated unit deg", "unit: rad'")),
    ({"t_s": "s"}, {"t": 1e3}, ("t_s", "stated unit s:", "unit: ms'")),
    ({"t_s": "ms"}, {"t": 1e-3}, ("t_s", "stated unit ms:", "unit: s'"))])
def test_a_stated_unit_that_physics_denies_is_named_with_the_likely_one(stated, factors, words):
    c = changed(whole(), stated, **factors)
    message = stated_units(c, c.plan()).message
    assert all(word in message for word in words), message
    assert [o.check for o in survey_with_physics(c).oddities if o.severity == "warning"] == ["stated_units"]


@pytest.mark.parametrize(("stated", "factors"), [
    (torques("N m"), {}), (torques("N m"), {"tau": 1 / 9.8}), ({}, {"tau": 1e-2}), ({"tau1_Nm": "N m"}, {"tau": 1e3}), ({"t_s": "ms"}, {})])
def test_a_stated_unit_that_may_be_right_is_taken_as_given(stated, factors):
    c = changed(whole(), stated, **factors)
    assert stated_units(c, c.plan()) is None
