"""What an instrument effect looks at: slopes in time, with motion and with the water."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypotheses import made, steady, view
from rigs import arm, run
from scipy.interpolate import CubicSpline

from nnhydro.effects.sensor_view import time_derivative
from nnhydro.physics.motion import tensor


def test_rows_that_stand_still_know_no_time():
    seen = view(arm(2), steady(np.random.default_rng(4).uniform(-1, 1, (30, 2)), 0.0, 0.0, 0.7))
    late = made("sensor_timing", arm(2), lag=(0.5,), low_pass=(0.5,))
    assert torch.equal(late.apply(seen), seen.tau)
    assert not late.columns(seen).any()


@pytest.mark.parametrize("n", [4, 5, 50])
def test_the_time_derivative_is_that_of_a_cubic_spline(n):

    t, x = np.linspace(1, 3, n), np.random.default_rng(0).standard_normal((n, 2))
    assert np.allclose(time_derivative(tensor(t), tensor(x)).numpy(), CubicSpline(t, x)(t, 1), atol=1e-9)


def test_a_reading_changes_with_an_angle_a_rate_and_an_acceleration_as_its_slopes_say():
    a, motion = arm(2), run(2)
    seen = view(a, motion)
    dq = 1e-6 * torch.sin(2 * motion.t)
    dqd, dqdd = 2e-6 * torch.cos(2 * motion.t), -4e-6 * torch.sin(2 * motion.t)
    only = torch.tensor([0.0, 1.0], dtype=torch.float64)
    moved = seen.flow_moved_by(dq[:, None] * only, dqd[:, None] * only, dqdd[:, None] * only)
    want = seen.torque_of(moved) - seen.tau
    slopes = [seen.by_motion(channel, 2) for channel in range(3)]
    assert torch.allclose(slopes[0] * dq[:, None] + slopes[1] * dqd[:, None] + slopes[2] * dqdd[:, None], want, rtol=1e-3, atol=1e-8)


def test_water_that_moves_with_the_arm_takes_the_slope_of_the_carriage_away():
    """A carriage along +Y is water along -Y: both slopes together are those of the rigid body alone, which knows no water."""
    a, motion = arm(2), run(2)
    seen = view(a, motion)
    by_velocity, _ = seen.by_water
    step = 1e-6
    faster = replace(seen.flow, motion=replace(motion, u0=motion.u0 + step))
    by_carriage = (seen.torque_of(faster) - seen.tau) / step
    assert torch.allclose(by_velocity[..., 1].sum(-1), -by_carriage, rtol=1e-4, atol=1e-4)
