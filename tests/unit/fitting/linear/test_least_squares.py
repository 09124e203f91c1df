"""Weighted least squares with priors and bounds, from sums alone."""

from functools import partial

import numpy as np
import pytest
from campaigns import GIVEN, campaign, planted
from rigs import arm

from nnhydro.fitting.identify import fit_units
from nnhydro.fitting.linear import least_squares
from nnhydro.fitting.linear.least_squares import bootstrap, correlation_time, joint_weights, solve
from nnhydro.fitting.linear.prior import Prior
from nnhydro.fitting.linear.statistics import Statistics, block, residual_energy, total, weight_joints
from nnhydro.models.baselines import BASELINES
from nnhydro.recordings.splitting import units


@pytest.mark.parametrize("width", [0, 1, 4])
def test_of_values_known_to_one_and_noise_of_unit_size_the_misfit_pulls_as_much_as_the_prior(width):
    rng = np.random.default_rng(width)
    A, y = rng.standard_normal((20, width)), rng.standard_normal((20, 3))
    z = least_squares.ridge(A, y)
    np.testing.assert_allclose(A.T @ (y - A @ z), z, atol=1e-12)


def start(a):
    return BASELINES["constant"].start(a)


def fitted(whole, loads=None):
    """Solution, blocks and prior of the constant baseline."""
    return fit_units(loads or start(whole.arm), units(whole, GIVEN), whole.arm)


def test_the_solution_is_where_the_gradient_vanishes():
    a = arm(2)
    whole = campaign(a, planted(a), noise=0.05)
    solution, blocks, before = fitted(whole)
    H, g = weight_joints(total(blocks), solution.weight)
    z = np.linalg.lstsq(before.F, solution.theta - before.mean, rcond=None)[0]
    gradient = before.F.T @ (H @ solution.theta - g) + z
    assert np.abs(gradient).max() < 1e-8 * np.abs(before.F.T @ g).max()


@pytest.mark.parametrize("r", [0.0, 0.5, 0.9])
def test_the_correlation_time_of_an_autoregression_is_known_in_closed_form(r):
    rng = np.random.default_rng(1)
    x = np.zeros(200_000)
    for k, e in enumerate(rng.standard_normal(len(x) - 1)):
        x[k + 1] = r * x[k] + e
    assert correlation_time(x) == pytest.approx((1 + r) / (1 - r), rel=0.1)


@pytest.mark.parametrize("n", [8, 41, 60])
def test_the_correlation_time_is_the_sum_of_correlations_up_to_five_times_itself(n):
    rng = np.random.default_rng(n)
    x = np.convolve(rng.standard_normal(n + 2), [1.0, 0.8, 0.5], "valid")
    d = x - x.mean()
    rho = np.array([d[:n - k] @ d[k:] for k in range(n // 2)]) / (d @ d)
    times = 2 * np.cumsum(rho) - 1
    ends = [k for k in range(len(times)) if k >= 5 * times[k]]
    assert correlation_time(x) == pytest.approx(max(times[ends[0] if ends else -1], 1.0), rel=1e-9)


def test_the_correlation_time_of_nothing_is_one():
    assert correlation_time(np.zeros(100)) == 1.0
    assert correlation_time(np.arange(5.0)) == 1.0


def test_a_bootstrap_is_repeatable_and_centred_on_the_fit():
    a = arm(1)
    solution, blocks, before = fitted(campaign(a, planted(a), 8, noise=0.02))
    draw = partial(bootstrap, blocks, before, solution.weight, 300)
    assert np.array_equal(draw(1), draw(1))
    assert not np.array_equal(draw(1), draw(2))
    spread = draw(1).std(0)
    assert (np.abs(draw(1).mean(0) - solution.theta) < 0.5 * spread + 1e-9).all()


def statistics(seed=1, n=200):
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, 2, 3))
    y = X @ np.array([1.0, 2.0, -1.0]) + [0.1, 1.0] * rng.standard_normal((n, 2))
    return X, y, block(X, y)


def test_the_weighted_penalised_fit_is_that_of_the_rows_with_the_prior_as_further_ones():
    X, y, stats = statistics()
    F, mean, weight = np.array([[1.0, 0], [0.2, 1.0], [0.0, 0.5]]), np.array([0.5, 0.0, -1.0]), np.array([4.0, 0.25])
    before = Prior(mean, F, np.full(2, -np.inf), np.full(2, np.inf))
    rows = np.concatenate([np.sqrt(weight[j]) * X[:, j] @ F for j in range(2)] + [np.eye(2)])
    right = np.concatenate([np.sqrt(weight[j]) * (y[:, j] - X[:, j] @ mean) for j in range(2)] + [np.zeros(2)])
    z = np.linalg.lstsq(rows, right, rcond=None)[0]
    told = solve(stats, before, weight)
    np.testing.assert_allclose(told.theta, mean + F @ z, rtol=1e-9)
    np.testing.assert_allclose(told.covariance, F @ np.linalg.inv(rows.T @ rows) @ F.T, rtol=1e-9)
    left = y - X @ told.theta
    np.testing.assert_allclose(told.rms, np.sqrt((left**2).mean(axis=0)), rtol=1e-6)
    np.testing.assert_allclose(residual_energy(stats, told.theta), (left**2).sum(axis=0), rtol=1e-6)
    assert not told.at_bound.any()
    A = rows.T @ rows
    scale = 1 / np.sqrt(np.diag(A))
    assert told.condition == pytest.approx(np.linalg.cond(A * np.outer(scale, scale)))
    H, g = weight_joints(stats, weight)
    np.testing.assert_allclose(H, sum(weight[j] * X[:, j].T @ X[:, j] for j in range(2)))
    np.testing.assert_allclose(g, sum(weight[j] * X[:, j].T @ y[:, j] for j in range(2)))
    both = total([stats, stats])
    np.testing.assert_allclose(both.n, [400, 400])
    np.testing.assert_allclose(both.s, 2 * (y**2).sum(axis=0))


def test_bounded_directions_stop_at_their_bounds_and_the_others_make_the_best_of_it():
    X, y, stats = statistics()
    before = Prior(np.zeros(3), np.eye(3), np.array([-np.inf, -np.inf, -0.5]), np.array([np.inf, 1.5, np.inf]))
    told = solve(stats, before, np.array([100.0, 1.0]))
    assert told.theta[1:] == pytest.approx([1.5, -0.5])
    np.testing.assert_array_equal(told.at_bound, [False, True, True])
    left = y - X[..., 1:] @ [1.5, -0.5]
    A, b = 1 + 100 * X[:, 0, 0] @ X[:, 0, 0] + X[:, 1, 0] @ X[:, 1, 0], 100 * X[:, 0, 0] @ left[:, 0] + X[:, 1, 0] @ left[:, 1]
    assert told.theta[0] == pytest.approx(b / A)
    near = Prior(np.zeros(3), np.eye(3), np.full(3, -np.inf), np.array([np.inf, 2.05, np.inf]))
    assert not solve(stats, near, np.array([100.0, 1.0])).at_bound.any()


def test_a_joint_weighs_by_its_residual_and_its_correlation_down_to_a_millionth_of_its_torque():
    X, y, stats = statistics()
    before = Prior(np.zeros(3), np.eye(3), np.full(3, -np.inf), np.full(3, np.inf))
    np.testing.assert_allclose(joint_weights(stats, before, np.array([0.1, 2.0]), np.array([5.0, 0.5])), [1 / (0.01 * 5), 1 / 4.0])
    size = np.sqrt((y**2).mean(axis=0))
    np.testing.assert_allclose(joint_weights(stats, before, np.zeros(2), np.ones(2)), 1 / (1e-6 * size) ** 2, rtol=1e-9)
    expected = Prior(np.array([50.0, 0.0, 0.0]), np.eye(3), np.full(3, -np.inf), np.full(3, np.inf))
    size = 50 * np.sqrt((X[..., 0] ** 2).mean(axis=0))
    np.testing.assert_allclose(joint_weights(stats, expected, np.zeros(2), np.ones(2)), 1 / (1e-6 * size) ** 2, rtol=1e-9)
    silent = Statistics(0 * stats.H, 0 * stats.g, 0 * stats.s, 0 * stats.n)
    assert np.isfinite(joint_weights(silent, before, np.zeros(2), np.ones(2))).all()


@pytest.mark.parametrize("phi", [0.5, 0.9])
def test_the_correlation_time_is_one_plus_twice_the_sum_of_correlations(phi):
    rng = np.random.default_rng(1)
    from scipy.signal import lfilter
    x = lfilter([1.0], [1.0, -phi], rng.standard_normal(200_000)) + 100.0
    assert correlation_time(x) == pytest.approx((1 + phi) / (1 - phi), rel=0.1)
    assert correlation_time(x[:7]) == 1.0
    assert correlation_time(np.tile([1.0, -1.0], 50)) == 1.0
