"""Effects may be of any order of magnitude: the evidence at the most probable size, against brute force."""

import numpy as np
import pytest
from problems import design, law, search
from scipy.integrate import quad
from scipy.stats import norm

from nnhydro.diagnosis.constants import RELEVANT, RHO
from nnhydro.diagnosis.model.evidence import posterior
from nnhydro.diagnosis.model.size_prior import SIZES, gain_of, size_and_bonus


def test_sizes_go_down_by_decades_to_what_is_relevant():
    assert SIZES[0] == RHO
    assert np.diff(np.log10(SIZES)) == pytest.approx(-1)
    assert RELEVANT <= SIZES[-1] * (1 + 1e-9) < 10 * RELEVANT


@pytest.mark.parametrize("c", [0.0, 3.0, 40.0, 300.0])
def test_the_gain_of_one_value_is_the_largest_integral_over_a_prior(c):
    R = 1000.0
    peak = c / R
    points = [0.0, peak, *(peak + s / np.sqrt(R) for s in (-6, -2, 2, 6))]
    whole = [quad(lambda x, rho=rho: norm.pdf(x, 0, rho) * np.exp(c * x - R * x**2 / 2), -2, 2, points=points, limit=500)[0]
             for rho in SIZES]
    assert float(gain_of(np.array([[R]]), np.array([[c]]))[0]) == pytest.approx(np.log(max(whole)), abs=1e-6)


def test_gain_and_bonus_are_one_evidence():
    rng, k = np.random.default_rng(1), 3
    X = rng.standard_normal((40, k)) * [1.0, 5.0, 20.0]
    R, c = X.T @ X, X.T @ rng.standard_normal(40)
    C = np.linalg.inv(R + np.eye(k) / RHO**2)
    under_rho = 0.5 * (c @ C @ c - np.linalg.slogdet(np.eye(k) + RHO**2 * R)[1])
    assert under_rho + size_and_bonus(C @ c, C)[1] == pytest.approx(float(gain_of(R, c[:, None])[0]), abs=1e-9)


def test_of_what_the_data_say_nothing_no_size_gains():
    assert size_and_bonus(np.zeros(2), RHO**2 * np.eye(2))[1] == pytest.approx(0, abs=1e-9), "the posterior is the prior"
    assert float(gain_of(np.zeros((2, 2)), np.zeros((2, 1)))[0]) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("rho", SIZES)
def test_the_most_probable_size_is_that_of_the_values(rho):
    assert size_and_bonus(rho * np.ones(6), 1e-8 * np.eye(6))[0] == rho


def test_a_small_effect_of_many_values_does_not_pay_for_large_ones():
    """Twenty values of a hundredth of RHO, known to a tenth."""
    small = RELEVANT * np.ones(20)
    assert size_and_bonus(small, (RELEVANT / 10) ** 2 * np.eye(20))[1] > 20 * np.log(10), "more than a decade a value"


def test_the_score_of_a_set_is_its_evidence_at_the_most_probable_size():
    of = design(3, joints=1)
    one = search(of, (law("a"),), of.Y[..., :1] + 0.5 * np.random.default_rng(4).standard_normal((*of.y.shape, 1)))
    found = one.score((0,))
    columns = one.view.join((0,))
    by_size = [posterior(one.view.whitened, columns, found.sizes.vector(one.view.whitened), rho).log_evidence for rho in SIZES]
    expected = max(by_size)
    score = found.score - one.view.library.log_prior(0)
    assert score == pytest.approx(expected, abs=0.01 * found.unknown_nats + 1e-6)
