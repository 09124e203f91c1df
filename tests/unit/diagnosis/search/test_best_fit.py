"""The fit whose values are told: least squares weighted by the noise beside the set, whatever noise the search began with."""

import numpy as np
import pytest
from problems import design, law, search

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.search.best_fit import best_fit, fit_at

LAWS = (law("a"), law("b", 2), law("c"))


def columns(of, width, seed=9):
    return np.random.default_rng(seed).standard_normal((*of.y.shape, width))


def test_it_is_ridge_regression_on_the_rows_divided_by_their_noise():
    of = design(1)
    X = columns(of, 4)
    one, v = search(of, LAWS, X), np.random.default_rng(2).uniform(0.5, 2.0, of.y.shape)
    fit = fit_at(one, one.score((0, 2)), v)
    D = np.concatenate([of.Y, X[..., [0, 3]]], axis=2).reshape(of.y.size, -1) / np.sqrt(v).reshape(-1, 1)
    wanted = np.linalg.solve(D.T @ D + np.diag([1, 1, RHO**-2, RHO**-2]), D.T @ (of.y / np.sqrt(v)).ravel())
    np.testing.assert_allclose(fit.posterior.mean[fit.coefficients], wanted, rtol=1e-6)
    np.testing.assert_allclose(fit.z, wanted[:2], rtol=1e-6)
    np.testing.assert_allclose(fit.residual.ravel(), (of.y / np.sqrt(v)).ravel() - D @ wanted, atol=1e-6)


def test_a_law_that_is_there_has_its_value_and_what_is_left_is_the_noise():
    plain = design(3, groups=6, rows=100, joints=1)
    X = columns(plain, 4)
    of = design(3, groups=6, rows=100, joints=1, planted=0.8 * X[..., 0], noise=0.1)
    one = search(of, LAWS, X, level=0.01)
    fit = best_fit(one, one.score((0,)))
    assert abs(fit.posterior.mean[fit.coefficients][2] - 0.8) < 0.03
    assert 0.9 < np.sqrt((fit.residual**2).mean()) < 1.1, "in units of the noise that it finds"


def test_the_noise_of_the_search_does_not_move_it():
    plain = design(4, groups=6, rows=60, joints=1)
    X = columns(plain, 4)
    of = design(4, groups=6, rows=60, joints=1, planted=0.5 * X[..., 1], noise=0.2)
    means = []
    for level in (0.04, 4.0):
        one = search(of, LAWS, X, level=level)
        fit = best_fit(one, one.score((1,)))
        means.append(fit.posterior.mean[fit.coefficients])
    np.testing.assert_allclose(means[0], means[1], rtol=1e-9)


def test_it_is_found_once_a_set():
    one = search(design(5), LAWS)
    assert best_fit(one, one.score((0,))) is best_fit(one, one.score((0,)))
    assert best_fit(one, one.score((1,))) is not best_fit(one, one.score((0,)))


def test_without_laws_it_is_the_baseline_alone():
    one = search(design(6), LAWS)
    fit = best_fit(one, one.score(()))
    assert fit.columns is None
    assert fit.rows.shape == (*one.whitened.y.shape, 2)


def test_of_a_machine_that_nothing_drives_baseline_values_are_those_over_the_factor_up_to_which_its_equation_holds():
    of = design(1)
    X = columns(of, 4)
    one = search(of, LAWS, X)
    driven = best_fit(one, one.score((0,)))
    assert driven.scale_factor == 1.0
    of.undriven, of.shares_of_model = True, lambda laws: np.full(len(laws), 0.4)
    free = fit_at(one, one.score((0,)), driven.whitened.v)
    law = free.posterior.mean[free.coefficients[2]]
    assert free.scale_factor == pytest.approx(1 - 0.4 * law), "two fifths of the law's torque lift the weight"
    assert abs(free.scale_factor - 1.0) > 0.01
    one.view.library.scale[:] = 0.5
    np.testing.assert_allclose(fit_at(one, one.score((0,)), driven.whitened.v).weight, [0.2], err_msg="the column is scaled, and its share")
    np.testing.assert_allclose(free.z, free.posterior.mean[:2] / free.scale_factor)
