"""The errors of one model on compared rows: through the filter of the measurement, and on the arm that was measured."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from campaigns import GIVEN, campaign, planted, recording
from rigs import arm, scaled

from nnhydro.evaluation.model_errors import coverage_of, misfit_and_coverage, misfit_of, model_torque, total_coverage
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation, prepare
from nnhydro.recordings.splitting import units

A = arm(1)
TRUE = StripTheory(A, GIVEN, {}, "constant", planted(A))
UNIT = units(campaign(A, planted(A), 1, seconds=2.0, rate=50.0), GIVEN)[0]


def test_the_true_model_leaves_nothing_and_knows_no_interval():
    misfit, coverage = misfit_and_coverage(TRUE, UNIT)
    assert misfit.error == pytest.approx(0.0, abs=1e-12)
    assert coverage is None
    assert coverage_of(TRUE, [UNIT]) is None
    assert total_coverage([]) is None


def test_what_was_judged_is_not_computed_again_to_be_drawn(monkeypatch):
    asked = []
    torque = StripTheory.torque
    monkeypatch.setattr(StripTheory, "torque", lambda model, motion: asked.append(model) or torque(model, motion))
    (segment,), other = UNIT.segments(), replace(TRUE)
    assert misfit_of(other, UNIT).error < 1e-12
    np.testing.assert_array_equal(model_torque(other, segment), segment.filter(torque(other, Motion.of(segment)).numpy()))
    assert asked == [other]
    model_torque(other, replace(segment))
    assert asked == [other, other]


def test_only_compared_rows_count():
    (segment,) = UNIT.segments()
    few = segment.keep & (np.arange(len(segment.t)) < 30)
    spoilt = replace(segment, keep=few, tau=np.where(few[:, None], segment.tau, 99.0))
    assert misfit_of(TRUE, replace(UNIT, segments=partial(tuple, [spoilt]))).error == pytest.approx(0.0, abs=1e-12)
    none = replace(segment, keep=np.zeros_like(few))
    assert misfit_of(TRUE, replace(UNIT, segments=partial(tuple, [none]))) is None


def test_a_unit_of_another_arm_is_predicted_with_the_masses_of_that_arm():
    large = scaled(A, 1.3)
    other = units(campaign(large, planted(large), 1, seconds=2.0, rate=50.0), GIVEN)[0]
    assert misfit_of(TRUE, replace(other, arm=large)).error < 1e-9
    assert misfit_of(TRUE, other).error > 0.1


def test_the_torque_of_a_model_goes_through_the_filter_of_the_measurement():
    how = Preparation(LowPass(3.0))
    (segment,) = prepare(recording(A, planted(A), seconds=4.0, rate=50.0), how)
    plain = TRUE.torque(Motion.of(segment)).numpy()
    assert np.array_equal(model_torque(TRUE, segment), segment.filter(plain))
    assert not np.array_equal(model_torque(TRUE, segment), plain)
