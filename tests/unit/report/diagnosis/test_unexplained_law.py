"""The mean of what no finding explains: recordings are counted, not rows, and a bin with too few of them is not drawn."""

from types import SimpleNamespace

import numpy as np
import pytest

from nnhydro.diagnosis.decision.heldout_errors import Residual
from nnhydro.report.diagnosis.unexplained_law import BINS, FEWEST, _law, _mean, unknown_laws

T95_OF_3 = 3.182446  # the quantile of Student's t with three degrees of freedom


def test_the_interval_of_equal_recordings_is_that_of_their_means():
    means, rows = np.array([1.0, 2.0, 3.0, 6.0]), 5
    which = np.repeat(np.arange(4), rows)
    m, half = _mean(np.repeat(means, rows) + np.tile([-1, -0.5, 0, 0.5, 1], 4), which)
    assert m == pytest.approx(3.0)
    assert half == pytest.approx(T95_OF_3 * means.std(ddof=1) / 2), "what rows differ by within a recording does not count"


def test_a_recording_of_few_rows_does_not_count_and_too_few_recordings_give_no_mean():
    which = np.repeat(np.arange(FEWEST), 3)
    assert _mean(np.ones(len(which)), which) == pytest.approx((1.0, 0.0))
    assert _mean(np.ones(len(which) - 1), which[1:]) is None, "the first recording has two rows left"


def parts(count=6, slope=2.0):
    """Recordings of one joint whose residual is `slope` times the angle, from 0 to 1 rad."""
    q = np.linspace(0, 1, 400)
    return [Residual(f"r{k}", slope * q[:, None], {"q1_rad": q}, 0.01) for k in range(count)]


def test_the_law_joins_the_means_of_its_bins():
    law = _law(parts(), 1, "q1_rad")
    assert (law.joint, law.driver, len(law.x)) == (1, "q1_rad", BINS)
    np.testing.assert_allclose(law.law, 2.0 * law.x, rtol=1e-9)
    np.testing.assert_allclose(law.half, 0.0, atol=1e-9)
    assert len(law.rows) == 6 * 400


def test_there_is_no_law_of_few_recordings_or_of_a_state_that_is_not_known():
    assert _law(parts(FEWEST - 1), 1, "q1_rad") is None
    assert _law(parts(), 1, "u0_m_s") is None


def test_a_law_is_drawn_of_each_joint_where_something_real_without_a_name_is_left():
    def told(detected=True, real=True, dt=0.01):
        remains = [Residual(part.recording, part.r, part.state, dt) for part in parts()]
        learned = [SimpleNamespace(joint=1, depends_on=("q1_rad",), real=real), SimpleNamespace(joint=2, depends_on=(), real=True)]
        return SimpleNamespace(heldout=SimpleNamespace(remains=remains), remainder=SimpleNamespace(detected=detected, learned=learned))

    assert [law.joint for law in unknown_laws(told())] == [1]
    assert unknown_laws(told(detected=False)) == unknown_laws(told(real=False)) == unknown_laws(told(dt=0.0)) == []
