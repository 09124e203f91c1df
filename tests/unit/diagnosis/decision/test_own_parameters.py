"""Other parameters in one recording are told from its noise, however large that is."""

import numpy as np
import pytest

from nnhydro.diagnosis.decision.own_parameters import gain_of_own_parameters


def dense(Y, r, size):
    """log N(r; 0, size + Y Y') with the full covariance matrix."""
    C = size * np.eye(len(r)) + Y @ Y.T
    return -0.5 * (np.linalg.slogdet(C)[1] + r @ np.linalg.solve(C, r))


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_noise_of_any_size_is_none_of_the_parameters(size):
    rng = np.random.default_rng(3)
    gains = [gain_of_own_parameters(rng.standard_normal((60, 5)), np.sqrt(size) * rng.standard_normal(60))[0] for _ in range(200)]
    assert max(gains) < 6


def test_the_gain_is_that_of_the_densities_at_the_most_probable_sizes():
    rng = np.random.default_rng(4)
    Y = rng.standard_normal((40, 3))
    r = Y @ [0.5, -1.0, 0.3] + 0.2 * rng.standard_normal(40)
    gain, z = gain_of_own_parameters(Y, r)
    sizes = np.geomspace(1e-4, 10, 4000)
    best = max(dense(Y, r, s) for s in sizes) - max(-0.5 * (40 * np.log(s) + r @ r / s) for s in sizes)
    assert gain == pytest.approx(best, abs=0.05)
    assert z == pytest.approx([0.5, -1.0, 0.3], abs=0.15)


def test_nothing_left_gains_nothing():
    assert gain_of_own_parameters(np.ones((5, 2)), np.zeros(5))[0] == 0.0


def test_what_the_records_of_an_acceleration_disagree_in_is_no_change_of_parameters():
    rng = np.random.default_rng(5)
    Y = rng.standard_normal((60, 4))
    disagreed, changed = (Y[:, k] + 0.3 * rng.standard_normal(60) for k in (3, 0))
    assert gain_of_own_parameters(Y, disagreed)[0] > 20
    assert gain_of_own_parameters(Y, disagreed, further=1)[0] < 3
    assert gain_of_own_parameters(Y, changed, further=1)[0] > 20


def test_columns_that_repeat_each_other_have_a_gain_however_small_the_noise():
    """Where nothing moves and nothing is read, columns whitened by the noise of a computer's digits are as large as numbers get."""
    r = np.random.default_rng(5).standard_normal(40)
    gain, z = gain_of_own_parameters(np.full((40, 2), 1e140), r)
    assert np.isfinite(gain)
    assert np.abs(z).max() < 1e-139
