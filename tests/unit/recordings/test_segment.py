"""A stretch with every derivative in place: model and measurement pass one filter."""

from dataclasses import replace

import numpy as np
from campaigns import GIVEN, planted, recording
from rigs import arm

from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import prepare

A = arm(2)
(SEGMENT,) = prepare(recording(A, planted(A), seconds=2.0), GIVEN)


def test_the_grid_is_even_and_a_single_row_counts_as_one():
    assert np.isclose(SEGMENT.dt, 0.01)
    assert replace(SEGMENT, t=SEGMENT.t[:1]).dt == 1.0
    assert SEGMENT.n_links == 2


def test_without_a_filter_a_model_is_compared_as_it_is():
    assert SEGMENT.filter(SEGMENT.tau) is SEGMENT.tau
    low = replace(SEGMENT, low_pass=LowPass(5.0))
    assert np.array_equal(low.filter(SEGMENT.tau), LowPass(5.0).apply(SEGMENT.tau, low.dt))


def test_a_base_and_a_current_whose_acceleration_nobody_gave_are_steady():
    rate = np.ones((len(SEGMENT), 2))
    moved = replace(SEGMENT, base=rate, current=rate)
    assert not moved.dbase.any()
    assert not moved.dcurrent.any()
    assert not moved.heading.any()
    assert np.array_equal(replace(moved, dbase=rate).dbase, rate)
    assert SEGMENT.dbase is SEGMENT.heading is None


def test_states_are_named_as_the_columns_are():
    states = SEGMENT.joint_states()
    assert set(states) == {f"{stem}{j}_{unit}" for j in (1, 2) for stem, unit in (("q", "rad"), ("dq", "rad_s"), ("ddq", "rad_s2"))}
    assert np.array_equal(states["dq2_rad_s"], SEGMENT.qd[:, 1])
