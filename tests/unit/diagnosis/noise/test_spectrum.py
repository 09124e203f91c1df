"""The spectrum of the noise: straight in the logarithms between its bands, in any unit of torque, and a scale for each recording."""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosed import ARM, campaign, made
from problems import design, unknown

from nnhydro.diagnosis.constants import FORM, LATE, MODEL_ERROR, NU, SMALLEST_SIZE
from nnhydro.diagnosis.model.evidence import Columns, WhiteRows, posterior
from nnhydro.diagnosis.model.sizes import Sizes, none
from nnhydro.diagnosis.model.unknown import unknown_of
from nnhydro.diagnosis.noise.spectrum import (
    Bands,
    _leverage,
    calibrated_noise,
    energy_to_explain,
    first_noise,
    form_variance,
    reestimate,
    white_noise,
    with_form_error,
)
from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.design import design_of
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation


def long(seed=0, groups=6, rows=200, **keys):
    """A design of one joint with enough rows for bands."""
    return design(seed, groups=groups, rows=rows, joints=1, **keys)


def times(of, factor):
    """The design with the torque, and what is measured in it, multiplied."""
    return SimpleNamespace(**{**vars(of), "Y": factor * of.Y, "y": factor * of.y, "tau": factor * of.tau, "scale": factor * of.scale,
                              "excess": factor * of.excess, "input_variance": factor**2 * of.input_variance,
                              "stated_friction": factor * of.stated_friction})


def rounds(of, noise, count=6):
    """The noise, estimated `count` times over beside the baseline alone."""
    for _ in range(count):
        white = WhiteRows(of, unknown(of), noise.v)
        noise = reestimate(of, noise, white, None, none(white).vector(white))
    return noise


@pytest.mark.parametrize("power", [0.0, -1.0, 2.0])
def test_between_the_centres_of_its_bands_a_power_of_the_frequency_is_that_power(power):
    of = long()
    f, bands = of.problem.frequency, Bands.of_design(of)
    S = np.where(bands.centre > 0, np.maximum(bands.centre, 1e-9), 1.0)[None] ** power
    moving = f > 0
    np.testing.assert_allclose(bands.spread(S)[moving, 0], f[moving] ** power, rtol=1e-9)


def test_the_mean_of_a_block_is_a_band_of_its_own():
    of = long()
    bands = Bands.of_design(of)
    means = of.problem.frequency == 0
    assert set(bands.of[means]) == {0}
    assert 0 not in bands.of[~means]
    S = np.r_[7.0, np.ones(bands.count - 1)][None]
    np.testing.assert_allclose(bands.spread(S)[means], 7.0)
    np.testing.assert_allclose(bands.spread(S)[~means], 1.0)


def test_bands_rise_with_the_frequency_and_leave_no_row_out():
    of = long()
    bands, f = Bands.of_design(of), of.problem.frequency
    order = np.argsort(f)
    assert (np.diff(bands.of[order]) >= 0).all()
    assert set(bands.of) == set(range(bands.count))
    assert ((bands.high == bands.low) | (bands.high == bands.low + 1)).all()


@pytest.mark.parametrize("level", [0.3, 2.0])
def test_of_white_noise_the_level_is_found_and_every_recording_is_as_loud(level):
    of = long(3, noise=level)
    noise = rounds(of, first_noise(of))
    moving = of.problem.frequency > 0
    assert noise.noise_variance[moving].mean() == pytest.approx(level**2, rel=0.15)
    np.testing.assert_allclose(noise.sigma2, 1.0, rtol=0.4)


@pytest.mark.parametrize("seed", [0, 1])
def test_what_a_large_baseline_takes_of_the_noise_is_counted_again(seed):
    """80 coefficients on 480 rows take a sixth of the noise's energy with them."""
    of = long(seed, rows=80, p=80)
    noise = rounds(of, first_noise(of))
    assert noise.v.mean() / (of.excess**2).mean() == pytest.approx(480 / 400, rel=0.03)


def test_a_recording_that_is_three_times_as_loud_has_nine_times_the_variance():
    of = long(4)
    loud = (of.problem.group_of == 2)[:, None]
    of.y[:] = of.y + 2 * loud * of.excess
    of.excess[:] = of.excess * (1 + 2 * loud)
    sigma2 = rounds(of, white_noise(of)).sigma2[:, 0]
    others = np.delete(sigma2, 2)
    assert sigma2[2] / others.mean() == pytest.approx(9.0, rel=0.35)
    assert others.max() < 2 * others.min()


def test_noise_that_falls_with_the_frequency_is_found_to_fall_as_it_does():
    of = long(5, rows=400)
    f = of.problem.frequency
    gain = np.where(f > 0, np.maximum(f, 1e-9), 1.0)[:, None] ** -0.5
    of.y[:], of.excess[:] = of.y + (gain - 1) * of.excess, gain * of.excess
    noise = rounds(of, white_noise(of))
    well = noise.bands.centre > 0.02
    slope = np.polyfit(np.log(noise.bands.centre[well]), np.log(noise.S[0, well]), 1)[0]
    assert slope == pytest.approx(-1.0, abs=0.2)


def test_the_noise_is_that_of_the_torque_in_whatever_unit():
    of, factor = long(6), 5.0
    for first in (first_noise, white_noise):
        one, other = (rounds(d, first(d), 2) for d in (of, times(of, factor)))
        np.testing.assert_allclose(other.sigma2, one.sigma2, rtol=1e-2)  # the baseline's prior is 1 in any unit
        np.testing.assert_allclose(other.S, factor**2 * one.S, rtol=1e-2)
        np.testing.assert_allclose(other.numerics, factor**2 * one.numerics, rtol=1e-9)


def test_the_leverages_add_up_to_the_coefficients_that_the_rows_determine():
    """sum_j d_j'H^-1 d_j = trace H^-1 (H - prior) = coefficients less what their priors still hold."""
    of = design(7, joints=2)
    white = WhiteRows(of, unknown(of), np.ones_like(of.y))
    X = np.random.default_rng(8).standard_normal((*of.y.shape, 2))
    columns, sizes = Columns.of(white, white.weigh(X)), Sizes.even(white, 0.3)
    fit = posterior(white, columns, sizes.vector(white))
    left, h = _leverage(white, columns, fit)
    assert h.sum() == pytest.approx((1 - fit.variances()).sum(), rel=1e-6)
    alone = replace(white.unknown, Phi=0 * white.unknown.Phi)
    bare = WhiteRows(of, alone, np.ones_like(of.y))
    left, _ = _leverage(bare, None, posterior(bare, None, none(bare).vector(bare)))
    np.testing.assert_allclose(np.einsum("njp,nj->p", of.Y, left), posterior(bare, None, none(bare).vector(bare)).mean[:2], atol=1e-6)


def test_any_computed_torque_errs_by_the_numerics():
    of = long(10)
    noise = first_noise(of)
    for rows in (of.problem.frequency == 0, noise.bands.of == noise.bands.count - 1):
        for g in range(of.problem.groups):
            at = rows & (of.problem.group_of == g)
            energy = (of.excess[at] ** 2).mean() + ((of.tau - of.excess)[at] ** 2).mean()
            np.testing.assert_allclose(noise.numerics[at], MODEL_ERROR**2 * energy, rtol=1e-9)


def test_a_friction_that_is_stated_is_known_to_a_tenth_in_form():
    of, stated = long(12), long(12)
    stated.stated_friction = np.random.default_rng(12).standard_normal(of.y.shape)
    more = first_noise(stated).numerics - first_noise(of).numerics
    still = (of.problem.frequency == 0) & (of.problem.group_of == 0)
    np.testing.assert_allclose(more[still], FORM**2 * (stated.stated_friction[still] ** 2).mean(), rtol=1e-9)


def test_a_law_may_be_off_by_a_tenth_in_form_and_late_by_the_delay_of_a_drive():
    """tau(t - d) - tau(t) = -i 2 pi f d tau: the variance of a delay grows with the square of the frequency."""
    of = long(10)
    f, got, bands = of.problem.frequency, form_variance(of), first_noise(of).bands
    for rows in (f == 0, bands.of == bands.count - 1):
        at = rows & (of.problem.group_of == 0)
        np.testing.assert_allclose(got[at], (FORM**2 + (2 * np.pi * f[at, None] * LATE) ** 2) * (of.excess[at] ** 2).mean(), rtol=1e-9)


def test_no_law_is_late_by_more_than_all_of_itself():
    of = long(11)
    of.problem.frequency = 100 * of.problem.frequency
    bands = first_noise(of).bands
    cell = (bands.of == bands.count - 1) & (of.problem.group_of == 0)
    assert 2 * np.pi * of.problem.frequency[cell].min() * LATE > 1
    np.testing.assert_allclose(form_variance(of)[cell], (of.excess[cell] ** 2).mean(), rtol=1e-9)


def test_the_level_of_a_band_is_drawn_to_that_of_its_neighbours_as_if_these_had_been_seen_so_often():
    """A band of n rows, ten times as loud as all others, keeps n / (n + NU) of ln 10; the rest is that of the mean with its neighbours."""
    of = long(12)
    of.Y, flat = of.Y[..., :0], white_noise(of)
    flat = replace(flat, S=np.ones_like(flat.S), numerics=np.zeros_like(flat.numerics))
    count, loud = np.bincount(flat.bands.of), 3
    of.y = np.where(flat.bands.of == loud, np.sqrt(10), 1.0)[:, None]
    white = WhiteRows(of, unknown(of), flat.v)
    S = reestimate(of, flat, white, None, none(white).vector(white)).S[0]
    n, around = count[loud], count[loud - 1:loud + 2].sum()
    assert np.log(S[loud]) / np.log(10) == pytest.approx((n + NU * n / around) / (n + NU), rel=1e-6)
    assert np.log(S[loud - 1]) / np.log(10) == pytest.approx(NU * n / count[loud - 2:loud + 1].sum() / (count[loud - 1] + NU), rel=1e-6)
    assert S[-1] == pytest.approx(1.0)


def designed(of):
    problem = problem_of(of)
    return design_of(problem, baseline_of("constant", ARM, problem.units(), Preparation(LowPass(problem.edge))))


@cache
def estimated(name):
    """The design of a campaign, its noise beside the unknown, and the unknown's sizes."""
    of = designed(campaign(name))
    noise, _, sizes, _ = calibrated_noise(of, unknown_of(of, of.baseline.at(np.zeros(of.Y.shape[2]))))
    return of, noise, sizes


def test_what_the_noise_of_the_motion_makes_of_the_torque_is_in_the_variance_from_the_first():
    quiet, shaken = designed(campaign("healthy")), designed(campaign("healthy"))
    extra = 0.01 * np.linspace(1, 2, quiet.y.size).reshape(quiet.y.shape)
    vars(shaken)["input_variance"] = quiet.input_variance + extra
    for noise in (first_noise, white_noise):
        np.testing.assert_allclose(noise(shaken).v - noise(quiet).v, extra, rtol=1e-6)


def test_few_rows_are_no_steeper_noise_than_a_random_walk():
    count = [4, 5, 6, 40]  # rows of the means, and of bands at 1, 2 and 4 Hz
    of = np.repeat(np.arange(4), count)
    bands = Bands(of, np.array([0.0, 1.0, 2.0, 4.0]), of, of, np.zeros(len(of)))
    steep, flat = np.array([900.0, 500.0, 60.0, 1.0]), np.array([2.0, 3.0, 0.5, 1.0])
    np.testing.assert_allclose(bands.within_random_walk(steep, True), [64.0, 16.0, 4.0, 1.0])
    np.testing.assert_allclose(bands.within_random_walk(steep, False), [900.0, 16.0, 4.0, 1.0], err_msg="a sensor's zero may move")
    np.testing.assert_array_equal(bands.within_random_walk(flat, True)[1:], np.minimum(flat[1:], [2.0, 4.0, 1.0]))
    many = np.repeat(np.arange(4), 40)
    sure = Bands(many, bands.centre, many, many, np.zeros(len(many)))
    np.testing.assert_array_equal(sure.within_random_walk(steep, True), steep, err_msg="as many rows as that tell how steep it is")


@pytest.mark.parametrize("undriven", [True, False])
def test_what_is_missing_in_a_record_of_few_rows_is_no_noise(undriven):
    """Seven rows of which the slowest are 100 times as large: a random walk is louder there, but by far less."""
    of = design(3, groups=1, rows=7, joints=1, noise=0.01)
    of.undriven = undriven
    large = np.array([10.0, 10.0, 0, 0, 0, 0, 0])[:, None]
    of.y, of.excess = of.y + large, of.excess + large
    noise = rounds(of, first_noise(of))
    S, f = noise.S[0], noise.bands.centre
    for low, high in pairwise(np.flatnonzero(f > 0)):
        assert S[low] <= S[high] * (f[high] / f[low]) ** 2 * (1 + 1e-9)
    assert (S[0] <= 4 * S[1] * (1 + 1e-9)) == undriven, "only the zero of a torque sensor may move"


def test_an_error_of_form_counts_as_noise_only_until_the_noise_is_known():
    """A large cause in one recording must not be the noise of all; but what is found at last is noise and numerics alone."""
    of, noise, _ = estimated("noise ratio 3")
    first = first_noise(of)
    np.testing.assert_allclose(with_form_error(of, first).v - first.v, FORM**2 * energy_to_explain(of), rtol=1e-9)
    np.testing.assert_array_equal(noise.numerics, first.numerics)


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
    assert np.sqrt(noise.noise_variance.sum() / of.duration) == pytest.approx(np.sqrt(np.mean(added)), rel=0.3)


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
    assert sizes.tau.max() < 0.02
    assert (sizes.tau >= SMALLEST_SIZE).all()


def test_every_row_has_a_variance_that_is_finite_and_more_than_that_of_the_noise_alone():
    of, noise, _ = estimated("noise ratio 10")
    assert np.isfinite(noise.v).all()
    assert (noise.v > noise.noise_variance).all()
    assert noise.v.shape == of.y.shape
    assert first_noise(of).noise_variance.min() > 0


def test_bands_hold_the_mean_of_a_block_apart_and_grow_with_frequency():
    of, _, _ = estimated("noise ratio 3")
    bands = Bands.of_design(of)
    assert set(of.problem.frequency[bands.of == 0]) == {0.0}
    assert (np.diff(bands.centre) > 0).all()
    assert bands.count == len(bands.centre) == bands.of.max() + 1


def test_the_scale_of_the_torque_scales_the_noise():
    def level(factor):
        from dataclasses import replace

        of = designed(Campaign.of(ARM, [replace(r, tau=factor * r.tau) for r in campaign("noise ratio 3").recordings()]))
        return first_noise(of).noise_variance.sum()

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
    exact = designed(Campaign.of(ARM, made(noise=lambda k: 0.0)))
    of = designed(Campaign.of(ARM, noisy))
    f = of.problem.frequency
    left = of.excess[:, 0] ** 2
    for low, high in ((0.5, 0.8), (0.8, 1.0)):
        rows = (f > low * of.problem.edge) & (f <= high * of.problem.edge)
        assert 0.4 < of.input_variance[rows, 0].mean() / left[rows].mean() < 2.5
    assert of.input_variance[f > 0.7 * of.problem.edge].mean() > 3 * of.input_variance[f < 0.4 * of.problem.edge].mean()
    assert exact.input_variance.mean() < 0.01 * of.input_variance.mean()
