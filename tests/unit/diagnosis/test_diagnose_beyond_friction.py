"""Whole diagnoses of laws that no card has, drives, drifts, delays, and what lies in a part of a campaign or in one recording."""

import re

import pytest
from diagnosed import FRICTION, diagnosed, named, value

RUBS = {("coulomb_friction", 1)}


@pytest.mark.slow
def test_an_unlisted_law_is_detected_told_by_what_it_depends_on_and_not_named():
    told = diagnosed("an unlisted law")
    assert named(told) == set()
    assert told.detected
    assert set(told.document()["unexplained"]["depends_on"]) & {"q1_rad", "dq1_rad_s"}
    assert "no known effect explains the difference" in told.verdict()


@pytest.mark.slow
def test_a_law_of_the_state_is_no_hum():
    assert diagnosed("an unlisted law").remainder.lines == ()


@pytest.mark.slow
def test_without_its_card_dry_friction_is_not_called_something_quite_different():
    told = diagnosed("rubbing", without=("coulomb_friction", "stribeck_friction", "load_friction"))
    assert told.detected
    assert told.remainder.detected or all(f.confidence < 0.9 for f in told.findings)


@pytest.mark.slow
def test_a_drive_whose_resonance_lies_near_the_band_is_found_with_its_stiffness():
    told = diagnosed("soft drive")
    assert named(told) == {("joint_elasticity", 1)}
    assert value("soft drive", "joint_elasticity", "stiffness")[0] == pytest.approx(393.6, rel=0.2)  # inertia times (2 pi 6 Hz)^2


@pytest.mark.slow
def test_a_drift_is_found_by_the_clock_whatever_the_names_of_the_files():
    assert ("torque_drift", 1) in named(diagnosed("drift"))
    change, low, high = value("drift", "torque_drift", "change")
    assert change == pytest.approx(0.6, abs=0.06)
    assert low <= 0.6 <= high


@pytest.mark.slow
def test_friction_that_begins_in_mid_campaign_is_told_with_the_recording_it_begins_in_and_kept_in_the_model():
    told = diagnosed("rubbing since the fourth")
    assert named(told) == RUBS
    (finding,) = told.findings
    assert finding.activity.since
    assert finding.activity.recordings == tuple(f"run{k:02d}" for k in range(3, 8))
    assert "from recording run03 on" in finding.statement
    assert finding.persists
    level, low, high = value("rubbing since the fourth", "coulomb_friction", "level")
    assert level == pytest.approx(FRICTION, rel=0.05)
    assert low <= FRICTION <= high


@pytest.mark.slow
def test_a_delay_is_told_as_a_delay_and_not_as_half_a_low_pass():
    assert named(diagnosed("late")) == {("sensor_timing", 0)}
    for parameter, true in (("lag", 0.02), ("delay", 0.02), ("low_pass", 0.0)):
        got, low, high = value("late", "sensor_timing", parameter)
        assert got == pytest.approx(true, abs=0.001)
        assert low <= true <= high, parameter


@pytest.mark.slow
@pytest.mark.parametrize(("name", "recording"), [("not zeroed once", "run03"), ("a stop in one run", "run02")])
def test_what_lies_in_one_recording_alone_is_no_noise_and_the_verdict_names_the_recording(name, recording):
    told = diagnosed(name)
    assert told.detected
    assert recording in told.verdict()


def test_what_no_parameter_of_the_model_explains_in_one_recording_is_told_of_that_recording():
    rest = diagnosed("a stop in one run").remainder
    assert rest.recordings == ("run02",)
    assert not rest.parameters_differ


@pytest.mark.slow
def test_a_joint_that_sticks_at_rest_has_dry_friction_and_no_breakaway_beside_its_viscous_one():
    told = diagnosed("sticking at rest")
    assert named(told) == {("coulomb_friction", 1), ("viscous_friction", 1)}
    for effect, parameter, true in (("coulomb_friction", "level", 4.0), ("viscous_friction", "coefficient", 3.0)):
        got, low, high = value("sticking at rest", effect, parameter)
        assert low <= true <= high
        assert got == pytest.approx(true, rel=0.05)
    assert value("sticking at rest", "coulomb_friction", "bending")[0] < 0.002, "between the points of the grid"
    assert told.heldout.after < 0.03


@pytest.mark.slow
def test_recordings_in_which_the_model_has_other_parameters_are_no_noise_and_the_verdict_says_so():
    told = diagnosed("filling")
    assert told.detected
    assert told.remainder.parameters_differ
    assert "run07" in told.remainder.recordings
    assert re.search(r"Mass, drag or added mass in [^.]*run07", told.verdict())
    for healthy in ("healthy", "noise ratio 10", "noise AR 0.95"):
        assert not diagnosed(healthy).remainder.recordings, healthy


def test_an_error_that_is_large_for_want_of_recordings_alone_is_no_alarm():
    told = diagnosed("two slow ones")
    assert told.heldout.after > 3 * told.noise_floor, "stretches are predicted badly from one another"
    assert not told.detected


@pytest.mark.slow
def test_noise_alone_on_an_arm_that_is_held_is_no_finding():
    assert named(diagnosed("held in still water")) == set()


@pytest.mark.slow
def test_a_finding_whose_every_interval_holds_nothing_at_all_is_none():
    findings = diagnosed("drift").findings
    assert findings
    for finding in findings:
        assert any(low > 0 or high < 0 for low, high in (p.ci95 for p in finding.parameters.values()))
