"""Rates that a logger computed from the angles are recognised by their lag, and no others are left out."""

from dataclasses import replace

import numpy as np
import pytest
from filtered_motions import STEP, recorded
from hypothesis import given, settings
from hypothesis import strategies as st

from nnhydro.recordings.filtering.computed_slopes import LEAST, LeftOut, are_integrals, lag_of_slope, without_computed_slopes


def differences(r, filtered):
    """The recording with the rates of a logger: backward differences of the angles behind a first-order filter of `filtered` samples."""
    rate = np.diff(r.q, axis=0, prepend=r.q[:1]) / STEP
    share = 1 - np.exp(-1 / filtered) if filtered else 1.0
    for k in range(1, len(rate)):
        rate[k] = rate[k - 1] + share * (rate[k] - rate[k - 1])
    return replace(r, qd=rate, qdd=None)


@given(late=st.floats(-0.03, 0.03), joint=st.integers(0, 1))
@settings(max_examples=20)
def test_the_lag_of_a_rate_is_known_to_a_quarter_of_a_sample(late, joint):
    r = recorded(late, noise=(1e-4, 1e-3, 0.0))
    found = lag_of_slope([(r.t, r.q[:, joint], r.qd[:, joint])])
    assert abs(found - late) < LEAST * STEP + 0.03 * abs(late)


@pytest.mark.parametrize("noise", [(0.0, 0.0, 0.0), (1e-3, 1e-2, 0.1), (1e-2, 1e-2, 0.1), (1e-4, 0.2, 1.0)])
def test_sensors_of_their_own_are_in_time_and_stay(noise):
    given_ones = [recorded(noise=noise, seed=seed) for seed in range(6)]
    kept, why = without_computed_slopes(given_ones)
    assert why == LeftOut()
    assert all(r.qd is not None and r.qdd is not None for r in kept)


def test_a_lag_that_no_difference_makes_is_none_however_certain():
    assert lag_of_slope([(r.t, r.q[:, 0], r.qd[:, 0]) for r in [recorded(late=0.8 * LEAST * STEP)]]) == 0
    assert lag_of_slope([(r.t, r.q[:, 0], r.qd[:, 0]) for r in [recorded(late=1.2 * LEAST * STEP)]]) > 0


@pytest.mark.parametrize("filtered", [0.0, 1.0])
@pytest.mark.parametrize("angle_noise", [0.0, 1e-4, 1e-3])
def test_differences_of_the_angles_are_left_out_of_all_recordings_of_their_logger(filtered, angle_noise):
    given_ones = [differences(recorded(noise=(angle_noise, 0.0, 0.0), seed=seed), filtered) for seed in range(4)]
    kept, why = without_computed_slopes([*given_ones, recorded(seed=9, seconds=0.5)])
    late = STEP * (0.5 + (1 / (np.e - 1) if filtered else 0.0))
    assert why.rates_lag == pytest.approx(late, rel=0.05)
    assert all(r.qd is None for r in kept)
    assert all(np.array_equal(r.q, was.q) for r, was in zip(kept, given_ones, strict=False))


def test_accelerations_in_time_with_the_angles_stay_where_the_rates_are_late():
    (own,), why = without_computed_slopes([recorded(late=0.008, later=0.0)])
    assert why.rates_lag == pytest.approx(0.008, rel=0.02)
    assert own.qd is None
    assert own.qdd is not None
    (both,), why = without_computed_slopes([recorded(late=0.008, later=0.008)])
    assert both.qdd is None
    (derived,), why = without_computed_slopes([recorded(later=0.01)])
    assert why == LeftOut(accelerations_lag=pytest.approx(0.01, rel=0.05))
    assert why.sentence().startswith("The recorded accelerations lag the angles by 10")
    assert derived.qd is not None
    assert derived.qdd is None


def test_what_is_early_stays():
    kept, why = without_computed_slopes([recorded(late=-0.005, later=-0.005)])
    assert why == LeftOut()
    assert kept[0].qd is not None
    assert kept[0].qdd is not None


def test_too_short_or_still_recordings_have_no_lag():
    t = np.arange(100) * STEP
    assert lag_of_slope([(t, np.zeros(100), np.zeros(100))]) == 0
    assert lag_of_slope([(t[:1], t[:1], t[:1])]) == 0
    assert lag_of_slope([]) == 0
    assert without_computed_slopes([]) == ([], LeftOut())


def integrated(r):
    """The recording of a tachometer: the angles are the integral of the rates by the trapezoidal rule, from the first angle."""
    steps = np.diff(r.t)[:, None] * (r.qd[1:] + r.qd[:-1]) / 2
    return replace(r, q=r.q[0] + np.concatenate([np.zeros((1, r.n_links)), np.cumsum(steps, axis=0)]), qdd=None)


@pytest.mark.parametrize("noise", [1e-4, 1e-2, 1.0])
def test_angles_that_are_the_integral_of_the_rates_are_marked_and_nothing_is_left_out(noise):
    tachometer = [integrated(recorded(noise=(0.0, noise, 0.0), seed=seed)) for seed in range(3)]
    kept, why = without_computed_slopes(tachometer)
    assert why == LeftOut(integrated=True)
    assert all(r.integrated and r.qd is not None for r in kept)
    assert "integral" in why.sentence()


@pytest.mark.parametrize("noise", [(0.0, 0.0, 0.0), (1e-6, 1e-2, 0.1), (1e-3, 1e-2, 0.1)])
def test_angles_of_an_encoder_are_no_integral_however_well_they_agree_with_the_rates(noise):
    assert not are_integrals([recorded(noise=noise, seed=seed) for seed in range(3)])
    rounded = [replace(r, q=np.round(r.q, 4)) for r in (integrated(recorded(noise=(0.0, 1e-3, 0.0))),)]
    assert not are_integrals(rounded), "steps of the angle hide whose the noise is"


@pytest.mark.parametrize("filtered", [0.0, 1.0])
def test_rates_that_are_differences_of_the_angles_make_no_integral(filtered):
    assert not are_integrals([differences(recorded(noise=(1e-3, 0.0, 0.0), seed=seed), filtered) for seed in range(3)])
    assert not are_integrals([replace(recorded(noise=(1e-3, 0.0, 0.0)), qd=None)])


def test_a_joint_at_rest_says_nothing_of_how_the_angles_were_made():
    still = [replace(r, q=r.q * [1, 0], qd=r.qd * [1, 0]) for seed in (5, 6) for r in [recorded(noise=(1e-3, 1e-2, 0.0), seed=seed)]]
    assert not are_integrals(still)
    assert not are_integrals([replace(r, q=0 * r.q, qd=0 * r.qd) for r in still])
    assert are_integrals([integrated(replace(r, qd=r.qd * [1, 0])) for r in still])


def test_a_gap_in_a_tachometers_record_hides_nothing():
    r = integrated(recorded(noise=(0.0, 1e-2, 0.0)))
    gap = np.where((np.arange(len(r)) > 300) & (np.arange(len(r)) < 320), np.nan, 1.0)[:, None]
    assert are_integrals([replace(r, q=gap * r.q, qd=gap * r.qd)])
