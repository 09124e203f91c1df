"""Files of one campaign in two units, and angles of another origin: physics tells them, and accuses no honest campaign."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import campaign, planted
from rigs import arm

from nnhydro.fitting.mixed_units import mixed_units, suspects
from nnhydro.fitting.physical_survey import survey_with_physics
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign

DEG = 180 / np.pi


def whole(links=2, count=6, **keys):
    a = arm(links)
    return campaign(a, planted(a).plus("c", CoulombTerm((0.2, 0.1)[:links])), count, noise=0.05, seconds=4.0, rate=50.0, **keys)


def changed(c, change, *names):
    """The campaign with the recordings `names` changed."""
    return Campaign.of(c.arm, [replace(r, **change(r)) if r.name in names else r for r in c.recordings()])


def angle(factor):
    """The first angle and its rates times `factor`."""
    def change(r):
        scale = np.eye(r.q.shape[1])[0] * (factor - 1) + 1
        return {"q": scale * r.q, "qd": scale * r.qd, "qdd": scale * r.qdd}
    return change


@pytest.mark.parametrize("links", [1, 2])
def test_one_mapping_for_all_files_of_which_one_was_in_degrees_is_seen(links):
    c = changed(whole(links), angle(1 / DEG), "run0", "run1", "run2", "run4", "run5")
    oddity = mixed_units(c, c.plan())
    assert oddity.where == "q1_rad, run0, run1, run2, run4 and 1 more"
    assert "57.3 times too small" in oddity.what
    assert "Take the unit out of columns.yaml" in oddity.remedy


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "mN m"), (1e2, "N cm")])
def test_one_file_with_torques_in_another_unit_is_named(factor, unit):
    c = changed(whole(), lambda r: {"tau": factor * r.tau}, "run3")
    oddity = mixed_units(c, c.plan())
    assert oddity.where == "tau1_Nm and tau2_Nm, run3"
    assert f"as in {unit}" in oddity.what


def test_a_tow_that_one_line_made_a_thousand_times_too_slow_is_named():
    c = changed(whole(), lambda r: {"u0": r.u0 / 1e3, "du0": r.du0 / 1e3}, "run1", "run5")
    assert mixed_units(c, c.plan()).where == "u0_m_s, run1, run5"


def test_motions_that_are_small_in_truth_are_left_alone():
    """Three recordings a fiftieth as large as the others, with the torques that physics gives them."""
    a = arm(2)
    large, small = whole().recordings(), []
    for r in whole().recordings():
        motion = angle(1 / DEG)(r)
        twin = campaign(a, planted(a), 1, seconds=4.0, rate=50.0).load("run0")
        small.append(replace(twin, name=f"small{r.name}", q=motion["q"], qd=motion["qd"], qdd=motion["qdd"], tau=_torques(a, motion)))
    c = Campaign.of(a, [*large, *small])
    assert list(suspects(c))
    assert mixed_units(c, c.plan()) is None


def _torques(a, motion):
    from campaigns import sensor_torque

    from nnhydro.physics.motion import Motion
    still = np.zeros(len(motion["q"]))
    rubbing = planted(a).plus("c", CoulombTerm((0.2, 0.1)))
    return sensor_torque(a, rubbing, Motion.at(motion["q"], motion["qd"], motion["qdd"], still, still))


def test_torques_of_another_run_are_told_and_those_of_this_one_are_not():
    c = whole()
    odd = changed(c, lambda r: {"tau": 5 + np.cos(20 * r.t[:, None] + np.arange(2))}, *c.names)
    assert "unexplained_torque" in [o.check for o in survey_with_physics(odd).oddities]
    assert "unexplained_torque" not in [o.check for o in survey_with_physics(c).oddities]


def test_a_drive_without_a_mass_or_a_fluid_is_not_asked_to_explain_its_torques():
    bare = Arm.model_validate({"name": "drive", "fluid": {"density_kg_m3": 0.0, "kinematic_viscosity_m2_s": 1e-6}, "links": [
        {"length_m": 0.1, "diameter_m": 0.05, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 0.0}]})
    c = whole(links=1)
    odd = changed(c, lambda r: {"tau": 5 + np.cos(20 * r.t[:, None])}, *c.names)
    light = Campaign.of(bare, list(odd.recordings()))
    assert "unexplained_torque" in [o.check for o in survey_with_physics(odd).oddities]
    assert "unexplained_torque" not in [o.check for o in survey_with_physics(light).oddities]
