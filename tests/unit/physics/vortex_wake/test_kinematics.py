"""How the cylinder moves: formulas that are consistent, and samples."""

import numpy as np
import pytest

from nnhydro.errors import ConfigError
from nnhydro.physics.vortex_wake.kinematics import power_start, sampled_motion


@pytest.mark.parametrize("n", [0.0, 0.5, 1.0, 3.0])
def test_a_power_of_time_is_consistent_with_itself(n):
    motion, t, h = power_start(2.0, n), np.array([0.3, 1.1]), 1e-6
    np.testing.assert_allclose((motion.travel(t + h) - motion.travel(t - h)) / (2 * h), motion.speed(t), rtol=1e-6)
    np.testing.assert_allclose((motion.speed(t + h) - motion.speed(t - h)) / (2 * h), motion.acceleration(t), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(motion.time_at(motion.travel(t)), t)
    assert (power_start(2.0, 0.0).acceleration(np.array([0.0, 1.0])) == 0).all()


def test_a_sampled_motion_starts_counting_at_its_first_sample_and_may_start_with_a_jump():
    t = np.linspace(5.0, 7.0, 41)
    motion = sampled_motion(t, 0.5 + 0.4 * (t - 5.0))
    x = np.array([0.2, 1.3])
    np.testing.assert_allclose(motion.speed(x), 0.5 + 0.4 * x, rtol=1e-9)
    np.testing.assert_allclose(motion.travel(x), 0.5 * x + 0.2 * x**2, rtol=1e-9)
    np.testing.assert_allclose(motion.acceleration(x), 0.4, rtol=1e-6)
    np.testing.assert_allclose(motion.time_at(motion.travel(x)), x, atol=1e-12)
    assert motion.farthest == pytest.approx(1.8)
    sampled_motion([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 1.0, 1.0])
    for U in ([0.0, 0.0, 1.0, 1.0], [-0.1, 1.0, 1.0, 1.0], [0.0, 1.0, 1.0, 0.0]):
        with pytest.raises(ConfigError, match="must stay positive after the start"):
            sampled_motion([0.0, 1.0, 2.0, 3.0], U)
    with pytest.raises(ConfigError, match="4 samples or more"):
        sampled_motion([0.0, 1.0, 2.0], [0.0, 1.0, 1.0])
