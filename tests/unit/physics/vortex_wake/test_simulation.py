"""The march in equal travels, and where a vortex is born."""

import numpy as np
import pytest

from nnhydro.physics.vortex_wake.choices import WakeChoices
from nnhydro.physics.vortex_wake.kinematics import power_start
from nnhydro.physics.vortex_wake.simulation import _steps, simulate_wake

CHOICES = WakeChoices()


def test_a_vortex_is_born_an_offset_above_the_wall_with_what_was_shed_in_the_step():
    history = simulate_wake(power_start(3.0, 1.0), 0.1, 0.5, CHOICES)
    dt = np.diff(np.sqrt(2 * np.linspace(0, 0.05, 26) / 3))
    assert len(history.t) == 25
    assert (history.vortices[np.isnan(history.separation)] == 0).all()
    flux = np.diff(np.append(0.0, history.shed)) / dt
    assert (flux[: int(np.isnan(history.separation).sum())] == 0).all()
    np.testing.assert_allclose(history.circulation * history.U * 0.1, history.shed, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(history.s_over_D, 0.5 * 3 * history.t**2 / 0.1, rtol=1e-12)
    np.testing.assert_allclose(history.dU, 3.0)


@pytest.mark.parametrize(("travel", "count"), [(1.0, 50), (1.001, 51), (0.005, 1), (0.1, 5)])
def test_steps_are_equal_in_travel_and_their_middles_equal_in_time(travel, count):
    steps = _steps(power_start(3.0, 1.0), 0.2, travel, CHOICES)
    assert len(steps) == count
    for k, step in enumerate(steps):
        s = 0.2 * travel * np.array([k, k + 1]) / count
        t = np.sqrt(2 * s / 3)
        assert (step.t, step.t_end, step.t_middle) == pytest.approx((t[0], t[1], t.mean()))
        assert step.s_middle == pytest.approx(1.5 * t.mean() ** 2)
        assert step.s_first_half == pytest.approx(step.s_middle - s[0])
        assert step.length == pytest.approx(s[1] - s[0])
