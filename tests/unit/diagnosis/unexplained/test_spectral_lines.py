"""A hum is told from noise: one line at one frequency in every recording, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.fft import dct, idct
from scipy.signal import lfilter

from nnhydro.diagnosis.decision.heldout_errors import Residual
from nnhydro.diagnosis.unexplained.spectral_lines import strongest


def noise(kind, shape, rng):
    white = rng.standard_normal(shape)
    if kind == "tailed":
        return rng.standard_t(3, shape)
    return white if kind == "white" else lfilter([0.6], [1, -0.8], white, axis=0)


def recordings(seed, kind="white", hum=lambda k, t: 0.0, count=10):
    rng, made = np.random.default_rng(seed), []
    for k in range(count):
        t = 0.02 * np.arange(int(rng.integers(250, 600)))
        r = noise(kind, (len(t), 2), rng)
        r[:, 1] += hum(k, t)
        made.append(Residual(f"run{k}", r, {}, 0.02))
    return made


@pytest.mark.parametrize("kind", ["white", "correlated", "tailed"])
def test_noise_is_not_taken_for_a_hum(kind):
    p = [strongest(recordings(seed, kind), 0).p_value for seed in range(60)]
    assert sum(x < 0.0025 for x in p) <= 1


def test_a_hum_is_found_at_its_frequency_with_its_size_in_the_channel_that_has_it():
    parts = recordings(1, hum=lambda k, t: 0.6 * np.sin(2 * np.pi * 7.3 * t + k))
    line = strongest(parts, 1)
    assert line.p_value < 1e-6
    assert line.frequency_hz == pytest.approx(7.3, abs=0.1)
    assert line.amplitude == pytest.approx(0.6, rel=0.25)
    assert "joint 2" in line.sentence()
    assert line.material
    assert strongest(parts, 0).p_value > 0.01


def test_a_hum_is_found_up_to_the_edge_of_the_band_behind_which_nothing_is_left():
    def cut(part, edge=8.0):
        spectrum = dct(part.r, axis=0, norm="ortho")
        spectrum[np.arange(len(spectrum)) / (2 * len(spectrum) * part.dt) > edge] = 0.0
        return replace(part, r=idct(spectrum, axis=0, norm="ortho"))

    humming = [cut(part) for part in recordings(3, hum=lambda k, t: 0.6 * np.sin(2 * np.pi * 7.3 * t + k))]
    assert strongest(humming, 1, 8.0).frequency_hz == pytest.approx(7.3, abs=0.1)
    assert strongest(humming, 1, 8.0).p_value < 1e-6
    quiet = [strongest([cut(part) for part in recordings(seed)], 0, 8.0).p_value for seed in range(60)]
    assert sum(x < 0.0025 for x in quiet) <= 1


def test_motions_at_frequencies_of_their_own_are_no_hum():
    line = strongest(recordings(2, hum=lambda k, t: 1.0 * np.sin(2 * np.pi * (2 + 0.9 * k) * t)), 1)
    assert line.p_value > 0.001


def irregular_sea(seed, peak, count=6):
    """Recordings of 30 s of a torque with the spectrum of a growing sea (JONSWAP) and a little noise."""
    rng, t = np.random.default_rng(seed), 0.02 * np.arange(1500)
    f = np.linspace(0.4, 5.0, 600)
    density = f**-5.0 * np.exp(-1.25 * (peak / f) ** 4) * 3.3 ** np.exp(-((f / peak - 1) ** 2) / (2 * 0.08**2))
    sizes = np.sqrt(2 * density / density.sum())
    seas = [sizes @ np.sin(2 * np.pi * np.outer(f, t) + rng.uniform(0, 2 * np.pi, (len(f), 1))) for _ in range(count)]
    return [Residual(f"run{k}", (sea + 0.05 * rng.standard_normal(len(t)))[:, None], {}, 0.02) for k, sea in enumerate(seas)]


def test_the_peak_of_an_irregular_sea_is_no_line():
    lines = [strongest(irregular_sea(seed, peak), 0) for seed in range(12) for peak in (1.0, 1.2)]
    assert sum(line is not None and line.material for line in lines) <= 1


def test_too_few_or_too_short_recordings_tell_nothing():
    assert strongest(recordings(3, count=3), 0) is None
    short = [Residual("a", np.zeros((30, 1)), {}, 0.01)] * 8
    assert strongest(short, 0) is None


def test_noise_of_angles_that_rises_to_the_edge_of_the_band_is_no_hum_however_few_frequencies_it_has():
    def rising(seed, edge=2.4, rows=232, dt=0.025):
        c = np.random.default_rng(seed).standard_normal((16, rows))
        f = np.arange(rows) / (2 * rows * dt)
        c = np.where(f < edge, c * (1 + (f / 1.2) ** 4), 0.0)
        return [Residual(f"run{k}", idct(one, norm="ortho")[:, None], {}, dt) for k, one in enumerate(c)]

    p = [strongest(rising(seed), 0, 2.4).p_value for seed in range(30)]
    assert sum(x < 0.0025 for x in p) <= 1


def test_at_frequencies_at_which_the_arm_itself_swings_in_all_recordings_no_hum_is_told():
    def swinging(with_motion):
        made = recordings(4, hum=lambda k, t: 0.6 * np.sin(2 * np.pi * 3.1 * t + k))
        moved = [np.sin(2 * np.pi * 3.1 * 0.02 * np.arange(len(p.r)) + k) + 0.01 * p.r[:, 0] for k, p in enumerate(made)]
        return [replace(p, state={"ddq1_rad_s2": x if with_motion else p.r[:, 0]}) for p, x in zip(made, moved, strict=True)]

    assert strongest(swinging(False), 1).p_value < 1e-6
    assert strongest(swinging(True), 1).p_value > 0.01


def test_in_recordings_of_a_few_frequencies_below_the_edge_no_hum_is_told():
    def cut(part, edge=2.4):
        spectrum = dct(part.r, axis=0, norm="ortho")
        spectrum[np.arange(len(spectrum)) / (2 * len(spectrum) * part.dt) > edge] = 0.0
        return replace(part, r=idct(spectrum, axis=0, norm="ortho"))

    short = [cut(replace(part, r=part.r[:140])) for part in recordings(5, count=16)]
    assert strongest(short, 0, 2.4) is None
