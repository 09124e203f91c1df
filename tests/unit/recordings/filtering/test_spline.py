"""Regression splines: least squares through each channel with its weight, whatever else is fitted on the same times."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline, make_lsq_spline

from nnhydro.recordings.filtering.spline import DEGREE, RegressionSplines, SmoothingSpline

EDGE = 2.0  # Hz


def records(seed, columns=2, n=160):
    t = np.linspace(0.0, 4.0, n)
    return t, np.random.default_rng(seed).standard_normal((n, columns))


@given(seed=st.integers(0, 1000), columns=st.integers(1, 4))
def test_angles_alone_give_the_least_squares_spline_of_scipy(seed, columns):
    t, x = records(seed, columns)
    splines = RegressionSplines.of(t, EDGE, [0])
    want = make_lsq_spline(t, x, splines.knots, DEGREE)
    np.testing.assert_allclose(splines.through([(0, x, np.ones(columns))], may_rest=False)(t), want(t), atol=1e-6)


@given(seed=st.integers(0, 1000))
def test_several_channels_are_weighed_as_dense_least_squares_would(seed):
    t, x = records(seed)
    rng = np.random.default_rng(seed + 1)
    splines = RegressionSplines.of(t, EDGE, [0, 1, 2])
    m = len(splines.knots) - DEGREE - 1
    basis = BSpline(splines.knots, np.eye(m), DEGREE)
    channels = [(order, rng.standard_normal(x.shape), rng.uniform(0.5, 2.0, 2)) for order in range(3)]
    got = splines.through(channels, may_rest=False).c
    for column in range(2):
        rows = np.concatenate([np.sqrt(w[column]) * (basis.derivative(order)(t) if order else basis(t)) for order, _, w in channels])
        values = np.concatenate([np.sqrt(w[column]) * v[:, column] for _, v, w in channels])
        np.testing.assert_allclose(got[:, column], np.linalg.lstsq(rows, values)[0], atol=1e-3)  # a ridge of 1e-9


def test_a_record_is_fitted_alike_alone_and_beside_others_of_other_weights():
    t, x = records(3, 3)
    splines, weights = RegressionSplines.of(t, EDGE, [0]), np.array([1.0, 5.0, 1.0])
    together = splines.through([(0, x, weights)], may_rest=False).c
    for column in range(3):
        alone = splines.through([(0, x[:, column:column + 1], weights[column:column + 1])], may_rest=False).c
        np.testing.assert_allclose(together[:, column], alone[:, 0], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("swing", "rests"), [(0.0, True), (20.0, False)])
def test_a_record_of_noise_is_a_constant_and_one_that_moves_is_not(swing, rests):
    t, noise = records(4, 1)
    x = 1.5 + noise + swing * np.sin(2 * np.pi * 0.5 * t)[:, None]
    rates = RegressionSplines.of(t, EDGE, [0]).through([(0, x, np.ones(1))]).derivative(1)(t)
    assert bool(np.abs(rates).max() < 1e-9) is rests


def test_knots_lie_closer_where_accelerations_are_measured():
    t, _ = records(5)
    pieces = [len(RegressionSplines.of(t, EDGE, orders).knots) for orders in ([0], [0, 1], [0, 2])]
    assert pieces[0] == pieces[1] < pieces[2]


@pytest.mark.parametrize(("times", "gain"), [(0.25, 1.0), (1.0, 0.5), (3.0, 0.0)])
def test_a_smoothing_spline_passes_half_of_what_lies_at_its_cutoff(times, gain):
    t = np.arange(4000) * 0.005
    x = np.sin(2 * np.pi * times * EDGE * t)[:, None]
    passed = SmoothingSpline(EDGE).apply(x, 0.005)[1000:3000]
    assert float((passed * x[1000:3000]).sum() / (x[1000:3000] ** 2).sum()) == pytest.approx(gain, abs=0.02)


@given(seed=st.integers(0, 1000), rows=st.integers(12, 60), cutoff=st.floats(0.1, 40.0))
def test_a_smoothing_spline_leaves_a_parabola_as_it_is_to_either_end(seed, rows, cutoff):
    t = np.arange(rows) * 0.01
    x = np.polynomial.polynomial.polyval(t, np.random.default_rng(seed).standard_normal((3, 2))).T
    np.testing.assert_allclose(SmoothingSpline(cutoff).apply(x, 0.01), x, atol=1e-5)
