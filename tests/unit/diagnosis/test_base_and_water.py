"""A diagnosis on a moving base, in moving water and of a linear axis: what surrounds the arm is no mismatch; models say what they saw."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import GIVEN, multi_sine, planted, sensor_torque
from rigs import arm

from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.design import design_of
from nnhydro.diagnosis.problem.problem import problem_of, segments_of
from nnhydro.models.domain import DOMAIN, Domain
from nnhydro.models.prediction import predict
from nnhydro.models.seen import marks_seen_by
from nnhydro.physics.loads.water_pressure import WaterPressure
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import parse_arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.content_hash import exact
from nnhydro.recordings.filtering.band import Band
from nnhydro.recordings.recording import Recording
from nnhydro.recordings.segment import Segment

A = arm(2)
T = np.arange(800) / 100


def swayed(seed):
    """A run (without torque) on a base that sways and yaws, in water that flows past: everything measured without noise."""
    w = 1.5 + 0.2 * seed
    base = np.column_stack([0.3 * np.sin(w * T), 0.4 * np.sin(0.8 * w * T)])
    current = np.column_stack([0.2 + 0.1 * np.sin(0.7 * w * T), 0.1 * np.cos(w * T)])
    return Recording(f"run{seed}", T, *(multi_sine(T, 2, seed, 0.8)[0],), base=base, current=current, u0=0.2 * np.sin(w * T))


def felt(r):
    """The recording with the torque that strip theory gives for its exact motion."""
    _, qd, qdd = multi_sine(T, 2, int(r.name[3:]), 0.8)
    w = 1.5 + 0.2 * int(r.name[3:])
    heading = 0.4 / (0.8 * w) * (1 - np.cos(0.8 * w * T))
    dbase = np.column_stack([0.3 * w * np.cos(w * T), 0.4 * 0.8 * w * np.cos(0.8 * w * T)])
    dcurrent = np.column_stack([0.1 * 0.7 * w * np.cos(0.7 * w * T), -0.1 * w * np.sin(w * T)])
    exact = Segment(r.name, T, r.q, qd, qdd, r.u0, 0.2 * w * np.cos(w * T), None, np.ones(len(T), bool), base=r.base, dbase=dbase,
                    heading=heading, current=r.current, dcurrent=dcurrent)
    loads = planted(A).plus("water_pressure", WaterPressure())
    return replace(r, tau=sensor_torque(A, loads, Motion.of(exact))), exact


def test_segments_hold_base_and_water_on_their_own_grid():
    r, exact = felt(swayed(1))
    (segment,) = segments_of(r, Band(3.0, 3.0))
    inner = segment.keep
    for name in ("base", "dbase", "heading", "current", "dcurrent"):
        want = getattr(exact, name).reshape(len(T), -1)
        got = getattr(segment, name).reshape(len(segment), -1)
        there = np.column_stack([np.interp(segment.t, T, x) for x in want.T])
        assert np.abs(got - there)[inner].max() < 0.02 * np.abs(there).max(), name


@pytest.mark.parametrize("forgotten", [(), ("base", "heading"), ("current",)], ids=["all", "base", "current"])
def test_physics_leaves_nothing_where_base_and_water_are_known_and_much_where_they_are_not(forgotten):
    runs = [replace(felt(swayed(k))[0], **dict.fromkeys(forgotten)) for k in (1, 2, 3)]
    problem = problem_of(Campaign.of(A, runs))
    design = design_of(problem, baseline_of("constant", A, problem.units(), GIVEN))
    left = np.sqrt((design.excess**2).sum() / (design.tau**2).sum())
    assert left > 0.1 if forgotten else left < 0.005


AXIS = parse_arm({"schema": "nnhydro/arm/1", "name": "ball screw", "fluid": {"density_kg_m3": 0.0}, "joints": [{"type": "prismatic"}],
                  "links": [{"mass_kg": 12.0, "known_to": 0.05}]}, "arm.yaml")


def slid(k, reach=1.0):
    """A run of a carriage of 12 kg with 20 N of dry friction, over `reach` times some 0.2 m."""
    rng = np.random.default_rng(k)
    w, a = 2 * np.pi * rng.uniform(0.2, 0.6, 2), reach * np.array([0.12, -0.1])
    phase = w * T[:, None]
    x, v, acc = ((a * y).sum(1) for y in (1 - np.cos(phase), w * np.sin(phase), w**2 * np.cos(phase)))
    force = 12.0 * acc + 20.0 * np.tanh(v / (1e-3 * reach)) + 0.3 * rng.standard_normal(len(T))
    return Recording(f"run{k}", T, x[:, None], force[:, None], v[:, None], acc[:, None])


@pytest.fixture(scope="module")
def slide():
    campaign = Campaign.of(AXIS, [slid(k) for k in range(1, 5)])
    return campaign, diagnose(campaign)


@pytest.mark.slow
def test_a_finding_on_a_linear_axis_is_told_in_newtons(slide):
    _, found = slide
    (finding,) = found.findings
    assert finding.effect == "coulomb_friction"
    assert " N" in finding.statement
    assert "N m" not in finding.statement + found.verdict()
    assert "rad" not in finding.statement
    assert {parameter.unit for parameter in finding.parameters.values()} == {"N"}
    assert found.document()["location"]
    assert not [place for place in found.document()["location"] if "rad" in place["where"]]


@pytest.mark.slow
def test_dry_friction_is_found_on_an_axis_that_creeps():
    """At half a millimetre a second: beside a step of dry friction of 0.005 rad/s it would never come to its level."""
    found = diagnose(Campaign.of(AXIS, [slid(k, reach=0.003) for k in range(1, 5)]))
    assert [finding.effect for finding in found.findings] == ["coulomb_friction"]
    assert found.findings[0].parameters["level"].value == pytest.approx(20.0, rel=0.05)
    assert found.heldout.after < 0.1


@pytest.mark.slow
def test_the_models_of_a_diagnosis_say_what_they_have_seen_and_where_they_are_at_home(slide):
    campaign, found = slide
    for model in (found.baseline, found.corrected):
        assert exact(marks_seen_by(model)) == {campaign.content(name) for name in campaign.names}
        assert Domain.parse(model.fit[DOMAIN]) is not None
    far = slid(9)
    far = replace(far, q=10 * far.q, qd=10 * far.qd, qdd=10 * far.qdd)
    assert predict(found.corrected, slid(1)).outside_share < 0.1 < 0.5 < predict(found.corrected, far).outside_share
