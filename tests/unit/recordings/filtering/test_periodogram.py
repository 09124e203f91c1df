"""The periodogram under a Hann window: a line stands at its frequency, and a second implementation agrees."""

import numpy as np
import pytest
from scipy.signal import periodogram

from nnhydro.recordings.filtering.periodogram import hann, hann_power


@pytest.mark.parametrize("zero_ends", [True, False])
def test_it_is_the_periodogram_of_scipy_but_for_its_scale(zero_ends):
    x = np.random.default_rng(0).standard_normal(201)
    window = hann(len(x), zero_ends)
    f, power = hann_power(x, 0.02, zero_ends)
    scale = 0.02 / (window**2).sum() * np.where(f > 0, 2, 1)  # one-sided density
    theirs = periodogram(x, 50.0, window, detrend=False)
    np.testing.assert_allclose(f, theirs[0])
    np.testing.assert_allclose(power * scale, theirs[1], rtol=1e-12, atol=1e-15)


def test_a_line_of_several_columns_stands_at_its_frequency_also_between_the_ordinates():
    t = 0.01 * np.arange(400)
    f, power = hann_power(np.stack([np.sin(2 * np.pi * 5.1 * t), np.cos(2 * np.pi * 9.6 * t)], axis=1), 0.01, points=3200)
    np.testing.assert_allclose(f[np.argmax(power, axis=0)], [5.1, 9.6], atol=0.02)


def test_the_window_without_zeros_at_its_ends_weighs_every_row():
    assert hann(5)[[0, -1]].tolist() == [0, 0]
    assert hann(5, zero_ends=False).min() > 0
