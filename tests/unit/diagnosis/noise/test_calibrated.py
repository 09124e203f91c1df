"""Noise: a spectrum common to all recordings and a scale of each, told from what the model explains."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from diagnosed import ARM, campaign, made

from nnhydro.diagnosis.constants import SMALLEST_SIZE
from nnhydro.diagnosis.model.unknown import unknown_of
from nnhydro.diagnosis.noise.calibrated import calibrated_noise
from nnhydro.diagnosis.noise.spectrum import Bands, first_noise, white_noise
from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.design import design_of
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation


def design(of):
    problem = problem_of(of)
    return design_of(problem, baseline_of("constant", ARM, problem.units(), Preparation(LowPass(problem.edge))))


@cache
def estimated(name):
    """The design of a campaign, its noise beside the unknown, and the unknown's sizes."""
    of = design(campaign(name))
    noise, _, sizes, _ = calibrated_noise(of, unknown_of(of, of.baseline.at(np.zeros(of.Y.shape[2]))))
    return of, noise, sizes


def test_what_the_noise_of_the_motion_makes_of_the_torque_is_in_the_variance_from_the_first():
    quiet, shaken = design(campaign("healthy")), design(campaign("healthy"))
    extra = 0.01 * np.linspace(1, 2, quiet.y.size).reshape(quiet.y.shape)
    vars(shaken)["input_variance"] = quiet.input_variance + extra
    for noise in (first_noise, white_noise):
        np.testing.assert_allclose(noise(shaken).v - noise(quiet).v, extra, rtol=1e-6)


@pytest.mark.parametrize(("name", "ratio"), [("noise ratio 3", 3.0), ("noise ratio 10", 10.0)])
def test_recordings_that_are_3_or_10_times_as_noisy_are_told_so(name, ratio):
    _, noise, _ = estimated(name)
    torques = np.array([np.sqrt((r.tau**2).mean()) for r in campaign(name).recordings()])
    relative = np.sqrt(noise.sigma2[:, 0]) / torques
    assert relative[1::2].min() > 1.5 * relative[::2].max()
    assert np.median(relative[1::2]) / np.median(relative[::2]) == pytest.approx(ratio, rel=0.35)


@pytest.mark.parametrize("name", ["noise ratio 3", "noise ratio 10", "noise AR 0.95"])
def test_the_level_of_the_noise_is_that_which_was_added(name):
    of, noise, _ = estimated(name)
    added = []
    for dirty, clean in zip(campaign(name).recordings(), made(noise=lambda k: 0.0), strict=True):
        spectrum = np.abs(np.fft.rfft(dirty.tau[:, 0] - clean.tau[:, 0])) ** 2 / len(dirty.tau) * 2 / len(dirty.tau)
        f = np.fft.rfftfreq(len(dirty.tau), 0.01)
        added.append(spectrum[f <= of.problem.edge].sum())
    assert np.sqrt(noise.own.sum() / of.time) == pytest.approx(np.sqrt(np.mean(added)), rel=0.3)


def test_coloured_noise_falls_with_frequency_and_white_noise_does_not():
    _, coloured, _ = estimated("noise AR 0.95")
    _, white, _ = estimated("noise ratio 3")
    def slope(noise):
        moving = noise.bands.centre > 0.3
        return np.polyfit(np.log(noise.bands.centre[moving]), np.log(noise.S[0, moving]), 1)[0]

    assert slope(coloured) < -0.8
    assert abs(slope(white)) < 0.5


@pytest.mark.parametrize("name", ["noise ratio 3", "noise ratio 10", "noise AR 0.95"])
def test_noise_is_not_taken_for_an_unknown_law(name):
    _, _, sizes = estimated(name)
    assert sizes.total.max() < 0.02
    assert (sizes.tau >= SMALLEST_SIZE).all()


def test_every_row_has_a_variance_that_is_finite_and_more_than_that_of_the_noise_alone():
    of, noise, _ = estimated("noise ratio 10")
    assert np.isfinite(noise.v).all()
    assert (noise.v > noise.own).all()
    assert noise.v.shape == of.y.shape
    assert first_noise(of).own.min() > 0


def test_bands_hold_the_mean_of_a_block_apart_and_grow_with_frequency():
    of, _, _ = estimated("noise ratio 3")
    bands = Bands.of_design(of)
    assert set(of.problem.frequency[bands.of == 0]) == {0.0}
    assert (np.diff(bands.centre) > 0).all()
    assert bands.count == len(bands.centre) == bands.of.max() + 1


def test_the_scale_of_the_torque_scales_the_noise():
    def level(factor):
        from dataclasses import replace

        of = design(Campaign.of(ARM, [replace(r, tau=factor * r.tau) for r in campaign("noise ratio 3").recordings()]))
        return first_noise(of).own.sum()

    assert level(10.0) > 20 * level(1.0)


@pytest.mark.parametrize("power", [-2.0, 0.0, 4.0])
def test_a_spectrum_that_is_a_power_of_the_frequency_is_one_on_the_rows_too(power):
    of, *_ = estimated("noise ratio 3")
    bands, f = Bands.of_design(of), of.problem.frequency
    moving = f > bands.centre[bands.centre > 0].min()
    S = np.maximum(bands.centre, 1e-9)[None, :] ** power
    assert bands.spread(S)[moving, 0] == pytest.approx(f[moving] ** power, rel=1e-6)


def test_what_noisy_angles_leave_in_the_torque_is_in_the_variance_and_grows_towards_the_edge():
    rng = np.random.default_rng(3)
    noisy = [replace(r, q=r.q + 1e-3 * rng.standard_normal(r.q.shape), qd=None, qdd=None) for r in made(noise=lambda k: 0.0)]
    exact = design(Campaign.of(ARM, made(noise=lambda k: 0.0)))
    of = design(Campaign.of(ARM, noisy))
    f = of.problem.frequency
    left = of.excess[:, 0] ** 2
    for low, high in ((0.5, 0.8), (0.8, 1.0)):
        rows = (f > low * of.problem.edge) & (f <= high * of.problem.edge)
        assert 0.4 < of.input_variance[rows, 0].mean() / left[rows].mean() < 2.5
    assert of.input_variance[f > 0.7 * of.problem.edge].mean() > 3 * of.input_variance[f < 0.4 * of.problem.edge].mean()
    assert exact.input_variance.mean() < 0.01 * of.input_variance.mean()
