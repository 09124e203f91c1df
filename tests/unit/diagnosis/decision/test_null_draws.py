"""Chance gains have the variance of the projected columns, where the baseline's prior hardly speaks and where nothing else does."""

import numpy as np
import pytest
from problems import design, law, search

from nnhydro.diagnosis.constants import LEAST_GAIN, RHO
from nnhydro.diagnosis.decision.null_draws import least_gain, null_gains

SEEDS = 12


@pytest.mark.parametrize("size", [0.03, 0.3, 30.0])
def test_the_products_of_a_law_are_drawn_with_the_gram_matrix_that_the_fit_leaves_of_it(size):
    of = design(3, joints=1)
    of.Y *= size  # the prior of the baseline's coefficients is 1
    X = of.Y[..., :1] / size + 0.3 * np.random.default_rng(4).standard_normal((*of.y.shape, 1))
    one = search(of, (law("a"),), X)
    null = one.score(())
    C = one.view.projection((), null.fit)
    R = float(one.view.grams[0][0, 0] - (C[:, 0] ** 2).sum())
    gains = np.concatenate([null_gains(one, null, seed) for seed in range(SEEDS)]) - one.view.library.log_prior(0)
    c2 = (2 * gains + np.log1p(RHO**2 * R)) * (1 + RHO**2 * R) / RHO**2
    assert c2.mean() == pytest.approx(R, rel=5 * np.sqrt(2 / len(gains)))


def test_what_is_expected_gains_by_chance_as_at_even_odds_and_must_exceed_that_by_its_odds():
    """The bar of the others stays: else the chance of friction, which is probable beforehand, would be asked of them, too."""
    of = design(5)
    even, expected = (search(of, (law("friction", standard=True, everywhere=everywhere), law("a"))) for everywhere in (False, True))
    drawn = [null_gains(one, one.score(()), 0) for one in (even, expected)]
    assert np.array_equal(*drawn)
    assert [least_gain(expected.view.library, 2.0, k) for k in (0, 1)] == [2.0 + LEAST_GAIN, LEAST_GAIN]
    assert [least_gain(expected.view.library, 5.0, k) for k in (0, 1)] == [5.0 + LEAST_GAIN, 5.0]
