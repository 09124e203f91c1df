"""Records that were smoothed hold less than the slope of the angles."""

from dataclasses import replace

import numpy as np
import pytest
from filtered_motions import STEP, recorded
from scipy.signal import savgol_filter

from nnhydro.recordings.filtering.computed_slopes import LeftOut, without_computed_slopes
from nnhydro.recordings.filtering.smoothed_slopes import is_smoothed


def smoothed(r, rows):
    """The recording with rates and accelerations by a local cubic over `rows` rows, as many prepare their data."""
    rate, acceleration = (savgol_filter(r.q, rows, 3, deriv=order, delta=STEP, axis=0) for order in (1, 2))
    return replace(r, qd=rate, qdd=acceleration)


def test_smoothed_slopes_are_left_out_where_the_angles_know_what_they_lack():
    quick = [replace(r, q=r.q + 0.02 * np.sin(2 * np.pi * 4 * r.t)[:, None]) for r in (recorded(seed=seed) for seed in range(3))]
    kept, why = without_computed_slopes([smoothed(r, 11) for r in quick])
    assert why == LeftOut(smoothed=True)
    assert all(r.qd is None and r.qdd is None for r in kept)
    kept, why = without_computed_slopes([smoothed(r, 5) for r in quick])
    assert why == LeftOut()
    assert all(r.qd is not None and r.qdd is not None for r in kept)


@pytest.mark.parametrize(("share", "late"), [(0.85, True), (0.95, False), (1.0, False), (1.1, False)])
def test_a_record_is_smoothed_below_nine_tenths_of_the_slope(share, late):
    t = np.arange(2000) * STEP
    x, slope = np.sin(2 * np.pi * t), 2 * np.pi * np.cos(2 * np.pi * t)
    assert is_smoothed([(STEP, x, share * slope)]) == late
    noisy = x + np.random.default_rng(1).standard_normal(len(x))
    assert not is_smoothed([(STEP, noisy, share * slope)]), "what is not known is no reference"
    assert not is_smoothed([(STEP, x[:60], share * slope[:60])])


def test_a_record_that_is_mostly_noise_is_not_called_smoothed():
    t = np.arange(2000) * STEP
    x, slope = np.sin(2 * np.pi * t), 2 * np.pi * np.cos(2 * np.pi * t)
    noise = 30.0 * np.random.default_rng(2).standard_normal(len(t))
    assert not is_smoothed([(STEP, x, 0.8 * slope + noise)])


@pytest.mark.parametrize("share", [0.85, 1.0])
def test_at_few_rows_a_period_the_reference_is_the_slope_and_not_its_difference(share):
    t = np.arange(1000) * 0.05
    assert is_smoothed([(0.05, np.sin(4 * np.pi * t), share * 4 * np.pi * np.cos(4 * np.pi * t))]) == (share < 0.9)
