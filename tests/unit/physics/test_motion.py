"""Rows of motion, with base and water."""

from dataclasses import replace

import numpy as np
import torch
from campaigns import GIVEN, recording
from moving_bases import everything, on_base
from rigs import arm, assert_close, run, torque

from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion, Water, tensor, trial_runs
from nnhydro.recordings.filtering.preprocessing import prepare


def test_some_rows_of_a_motion_keep_what_base_and_water_did():
    motion = on_base(run(2), yaw=0.5, x=0.3)
    motion = replace(motion, current=Water(torch.stack([motion.t, -motion.t], 1), torch.ones(len(motion), 2, dtype=torch.float64)))
    a, some = arm(2), slice(10, 30)
    assert_close(torque(everything(a), a, motion.rows(some)), torque(everything(a), a, motion)[some])


def test_water_that_moves_as_two_waters_do_moves_as_their_sum():
    alike, by_link = torch.ones(4, 2, dtype=torch.float64), torch.arange(16.0, dtype=torch.float64).reshape(4, 2, 2)
    both = Water(alike, 2 * alike) + Water(by_link, by_link)
    vx, vy, ax, ay = both.at_links()
    assert_close(vx, by_link[..., 0] + 1)
    assert_close(vy, by_link[..., 1] + 1)
    assert_close(ax, by_link[..., 0] + 2)
    assert_close(ay, by_link[..., 1] + 2)
    assert Water(alike, alike).at_links()[0].shape == (4, 1)


def test_states_are_steady_rows_and_a_number_is_that_of_every_row():
    motion = Motion.at([[0.1, 0.2], [0.3, 0.4]], 1.0, 0.0, u0=[0.5, 0.6])
    assert motion.steady
    assert not motion.surrounded
    assert motion.qd.tolist() == [[1.0, 1.0], [1.0, 1.0]]
    assert motion.u0.tolist() == [0.5, 0.6]


def test_a_segment_with_a_base_that_only_has_a_heading_stands_still():
    (segment,) = prepare(recording(arm(2), Loads({}), seconds=1.0), GIVEN)
    assert Motion.of(segment).base is None
    turned = Motion.of(replace(segment, heading=np.full(len(segment), 0.3)))
    assert turned.surrounded
    assert not turned.base.vx.any()
    assert bool((turned.base.heading == 0.3).all())
    moved = Motion.of(replace(segment, base=np.column_stack([segment.t, 2 * segment.t]), current=np.ones((len(segment), 2))))
    assert_close(moved.base.rate, 2 * moved.t)
    assert_close(moved.base.vx, moved.t)
    assert not moved.current.acceleration.any()


def test_a_tensor_has_memory_of_its_own():
    x = np.zeros(3)
    made = tensor(x)
    x[0] = 1.0
    assert made.dtype == torch.float64
    assert not made.any()


def test_trial_runs_are_consistent_in_time():
    for motion in trial_runs(2, 2001):
        for value, rate in ((motion.q, motion.qd), (motion.qd, motion.qdd), (motion.u0[:, None], motion.du0[:, None])):
            slope = (value[2:] - value[:-2]) / (motion.t[2:] - motion.t[:-2])[:, None]
            assert_close(slope, rate[1:-1], 1e-4, 1e-4)
