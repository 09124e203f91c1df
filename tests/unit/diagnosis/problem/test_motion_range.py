"""What is known of the motion of a campaign: ranges, means and rates of the joints, and the Reynolds numbers of the links."""

import dataclasses

import numpy as np
import pytest
from campaigns import campaign, planted
from rigs import arm

from nnhydro.diagnosis.problem.motion_range import MotionRange
from nnhydro.diagnosis.problem.problem import problem_of

ARM = arm(1)


def test_ranges_and_means_are_those_of_the_recordings():
    problem = problem_of(campaign(ARM, planted(ARM), count=4, noise=0.0), edge=3.0)
    q, rates = (np.concatenate([getattr(s.segment, name)[s.segment.keep] for s in problem.stretches]) for name in ("q", "qd"))
    found = MotionRange.of(problem)
    assert found.angles == pytest.approx(q.max(axis=0) - q.min(axis=0))
    assert found.means == pytest.approx(q.mean(axis=0))
    assert found.rates == pytest.approx(np.sqrt((rates**2).mean(axis=0)))
    assert found.reverses == (True,)


def test_reynolds_numbers_lie_between_those_of_the_root_and_of_the_tip_of_a_turning_link():
    problem = problem_of(campaign(ARM, planted(ARM), count=4, noise=0.0), edge=3.0)
    link = ARM.links[0]
    tip = link.length_m * link.diameter_m / ARM.fluid.kinematic_viscosity_m2_s * max(np.abs(s.segment.qd).max() for s in problem.stretches)
    low, high = MotionRange.of(problem).reynolds
    assert 0.01 * tip < low < 0.5 * high
    assert 0.6 * tip < high < tip


def test_in_air_there_are_no_reynolds_numbers():
    dry = dataclasses.replace(problem_of(campaign(ARM, planted(ARM), count=4, noise=0.0), edge=3.0), arm=arm(1, density=0.0))
    assert MotionRange.of(dry).reynolds is None
