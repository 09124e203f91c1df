"""The torque of a controller: saturation, delay, encoders."""

import numpy as np
import pytest
from campaigns import planted
from controlled_runs import RATE, run
from rigs import arm

from nnhydro.errors import ConfigError


def test_an_integral_stands_still_while_the_torque_is_clipped():
    r = run(planted(arm(2)), kind="pid", kp=40.0, kd=4.0, ki=100.0, torque_limit_Nm=[2.0, 0.5])
    assert np.abs(r.tau).max(axis=0).tolist() == [2.0, 0.5]
    assert np.abs(r.state.q).max() < 1.2


@pytest.mark.slow
def test_a_delay_shifts_the_torque_by_whole_periods():
    a = arm(2)
    plain, late = (run(planted(a), kind="pd", kp=40.0, kd=4.0, delay_s=delay) for delay in (0.0, 0.01))
    np.testing.assert_array_equal(late.tau[:2], 0.0)
    first = np.flatnonzero(plain.tau.any(axis=1))[0]
    assert np.flatnonzero(late.tau.any(axis=1))[0] == first + round(0.01 * RATE)
    with pytest.raises(ConfigError, match="not a whole number of periods"):
        run(planted(a), kind="pd", kp=40.0, kd=4.0, delay_s=0.003)


@pytest.mark.slow
def test_a_coarse_encoder_makes_the_torque_rough():
    a = arm(2)
    coarse, fine, ideal = (run(planted(a), kind="computed_torque", model="textbook", kp=100.0, kd=20.0, encoder_counts_per_rev=n).tau
                           for n in (1024, 2**22, None))
    assert np.abs(np.diff(coarse, n=2, axis=0)).mean() > 3 * np.abs(np.diff(fine, n=2, axis=0)).mean()
    assert np.abs(fine - ideal).max() < 0.3 * np.abs(ideal).max()
