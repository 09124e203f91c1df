"""The zero-phase low-pass: no delay, half at the cut-off, and ends that go on."""

import numpy as np
import pytest

from nnhydro.errors import ConfigError
from nnhydro.recordings.filtering.low_pass import LowPass, _extension
from nnhydro.recordings.filtering.preprocessing import derivatives


@pytest.mark.parametrize("cutoff", [3.0, 10.0])
def test_the_filter_delays_nothing(cutoff):
    x = np.random.default_rng(1).standard_normal(2000)
    y = LowPass(cutoff).apply(x, 0.01)
    lags = np.arange(-20, 21)
    correlation = [float((x[50:-50] * np.roll(y, -lag)[50:-50]).sum()) for lag in lags]
    assert lags[int(np.argmax(correlation))] == 0
    np.testing.assert_allclose(LowPass(cutoff).apply(x[::-1], 0.01)[200:-200], y[::-1][200:-200], atol=1e-6)


def test_the_filter_halves_a_wave_at_its_cutoff_and_keeps_a_slow_one():
    t = np.arange(0, 20, 0.005)
    for f, gain in ((1.0, 1.0), (10.0, 0.5), (30.0, 0.0)):
        y = LowPass(10.0).apply(np.sin(2 * np.pi * f * t), 0.005)[1000:-1000]
        assert np.abs(y).max() == pytest.approx(gain, abs=0.02)


def test_a_cutoff_beyond_the_sampling_passes_everything():
    x = np.random.default_rng(1).standard_normal((30, 2))
    assert np.array_equal(LowPass(50.0).apply(x, 0.01), x)


@pytest.mark.parametrize("cutoff", [0.0, -1.0, float("nan"), float("inf")])
def test_a_senseless_cutoff_is_refused(cutoff):
    with pytest.raises(ConfigError, match="positive frequency"):
        LowPass(cutoff)


def test_a_recording_that_begins_and_ends_in_motion_keeps_its_acceleration_there():
    t = np.arange(0, 8, 0.01)
    for phase in (0.0, 0.7, 1.5):
        q = np.sin(np.pi * t + phase) + 0.3 * np.sin(2.6 * np.pi * t + 2 * phase)
        true = -np.pi**2 * np.sin(np.pi * t + phase) - 0.3 * (2.6 * np.pi) ** 2 * np.sin(2.6 * np.pi * t + 2 * phase)
        found = derivatives(LowPass(16.0).apply(q[:, None], 0.01), 0.01, 2)[:, 0]
        wrong = np.abs(found - true) / np.sqrt((true**2).mean())
        assert wrong[[0, -1]].max() < 0.5
        assert wrong[2:-2].max() < 0.1


def test_what_goes_on_beyond_an_end_is_the_parabola_less_the_reflected_rest():
    parabola = np.arange(40.0)[:, None] ** 2
    np.testing.assert_allclose(_extension(parabola, 5, 8)[:, 0], np.arange(40.0, 45.0) ** 2, rtol=1e-9)
    wave = np.sin(np.arange(-39, 1) / 3.0)[:, None]  # it crosses zero at its last row: its odd reflection is its own continuation
    np.testing.assert_allclose(_extension(wave, 6, 40)[:, 0], np.sin(np.arange(1, 7) / 3.0), atol=0.05)


@pytest.mark.parametrize("f", [3.0, 5.0, 8.0])
def test_a_wave_passes_with_the_gain_of_the_formula(f):
    t, low = np.arange(0, 20, 0.002), LowPass(5.0)
    passed = low.apply(np.sin(2 * np.pi * f * t)[:, None], 0.002)[2000:-2000]
    assert np.sqrt(2 * (passed**2).mean()) == pytest.approx(1 / (1 + (f / 5.0) ** 8), abs=2e-3)
    assert low.gain(np.array([f])) == pytest.approx(1 / (1 + (f / 5.0) ** 8))
