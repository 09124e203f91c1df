"""Nonlinear values move together to where they fit best, as far as what was tried and physics allow."""

import numpy as np
import pytest
from oscillations import by_scipy, moved, with_oscillation


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
