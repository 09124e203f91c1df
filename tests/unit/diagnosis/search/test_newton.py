"""Nonlinear values move together to where they fit best, and are known as well as a least-squares fit of all values knows them."""

import numpy as np
import pytest
from oscillations import columns, with_oscillation
from scipy.optimize import least_squares

from nnhydro.diagnosis.search.best_fit import fit_at
from nnhydro.diagnosis.search.newton import at_best_values
from nnhydro.diagnosis.search.tangents import tangents_of
from nnhydro.diagnosis.search.values import values_of


def by_scipy(one, start):
    """Frequency, damping, and their deviations by a fit of all values to the same rows over known noise."""
    white = one.whitened

    def left(x):
        model = white.design.Y @ x[4:] + columns(white.design, *x[:2]) @ x[2:4]
        return ((white.design.y - model) / np.sqrt(white.v)).ravel()

    found = least_squares(left, np.concatenate([start, [0.8, 0.4], np.zeros(white.p)]), xtol=1e-12)
    return found.x[:2], np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))[:2]


def moved(one):
    """The grown search, its best set and the one member of it."""
    grown = at_best_values(one, one.score((0,)), None)
    (k,) = grown.best.chosen
    return grown.search, grown.best, k, grown.search.view.library.hypotheses[k].effect


@pytest.mark.parametrize("start", [(1.0, 0.5), (0.96, 0.1), (1.1, 1.2)])
def test_values_that_hang_together_reach_the_best_fit_from_beside_it(start):
    one = with_oscillation((1.05, 0.6), start)
    best, deviation = by_scipy(one, (1.05, 0.6))
    before = one.score((0,)).score
    _, found, _, effect = moved(one)
    assert np.all(np.abs([effect.frequency[0], effect.damping[0]] - best) < 0.4 * deviation)
    assert found.score > before + 1


def test_a_value_at_its_best_stays_where_it_is():
    one = with_oscillation((1.05, 0.6), (1.05, 0.6), noise=1e-6)
    *_, k, effect = moved(one)
    assert k == 0
    assert effect.frequency == (1.05,)


def test_no_value_leaves_its_physical_bounds():
    one = with_oscillation((1.05, 0.0), (1.0, 0.2), seed=3)
    *_, effect = moved(one)
    assert effect.damping[0] >= 0.0


@pytest.mark.parametrize("per_recording", [False, True])
def test_deviations_are_those_of_a_least_squares_fit_of_all_values(per_recording):
    one = with_oscillation((1.05, 0.6), (1.05, 0.6), noise=0.1, per_recording=per_recording)
    one.best_fits[(0,)] = fit_at(one, one.score((0,)), one.whitened.v)
    values = values_of(one, one.score((0,)), 0, tangents_of(one, one.score((0,))))
    _, deviation = by_scipy(one, (1.05, 0.6))
    at = [2 + values.names.index(name) for name in ("frequency", "damping")]
    ratio = np.sqrt(np.diag(values.covariance)[at]) / deviation
    assert np.all(ratio > 0.98)  # never less; more where recordings scatter, or have phases of their own
    assert np.all(ratio < (2.5 if per_recording else 1.8))


def test_intervals_of_nonlinear_values_hold_the_truth():
    inside = []
    for seed in range(25):
        search, found, k, effect = moved(with_oscillation((1.05, 0.6), (1.0, 0.5), seed=seed, rows=40))
        values = values_of(search, found, k, tangents_of(search, found))
        deviation = np.sqrt(np.diag(values.covariance)[2 + values.names.index("frequency")])
        inside.append(abs(effect.frequency[0] - 1.05) < 1.96 * deviation)
    assert 21 <= sum(inside) <= 25
    assert deviation < 0.05
