"""Chance gains have the variance of the projected columns, where the baseline's prior hardly speaks and where nothing else does."""

import numpy as np
import pytest
from problems import design, law, search

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.decision.null_draws import null_gains

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
