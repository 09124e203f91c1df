"""The library of candidates: columns in shares of the torque, prior odds, and the mass of the prior within physical bounds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problems import design, law, library, search

from nnhydro.diagnosis.search.library import bound_bonus, log_mass


def test_a_standard_term_of_a_joint_is_as_probable_as_not_and_any_other_law_one_in_all_keys():
    laws = (law("friction", standard=True), law("a"), law("b"))
    made = library(design(0), laws)
    assert made.log_prior(0) == 0.0
    assert made.log_prior(1) == pytest.approx(-np.log(len(laws)))


@given(mean=st.floats(-3, 3), sd=st.floats(0.01, 3), low=st.floats(-2, 0), width=st.floats(0.1, 5))
def test_the_mass_within_bounds_is_that_of_the_normal_distribution(mean, sd, low, width):
    from scipy.stats import norm

    got = float(np.exp(log_mass(np.array(low), np.array(low + width), np.array(mean), np.array(sd))))
    assert got == pytest.approx(norm.cdf(low + width, mean, sd) - norm.cdf(low, mean, sd), rel=1e-4, abs=1e-9)


def test_bounds_reward_what_lies_within_and_punish_what_lies_beyond():
    low, high = np.array([0.0]), np.array([np.inf])
    inside, outside = (bound_bonus(low, high, np.array([m]), np.array([0.01])) for m in (0.2, -0.2))
    assert inside == pytest.approx(np.log(2)), "half of the prior's mass lay on the wrong side"
    assert outside < -100
    assert bound_bonus(np.array([-np.inf]), high, np.array([0.2]), np.array([0.01])) == 0.0


def test_every_key_has_the_same_prior_and_every_law_of_a_key():
    one = search(design(0), (law("a"), law("a"), law("a"), law("b", joint=1), law("b", joint=2), law("c")))
    prior = np.exp([one.view.library.log_prior(k) for k in range(6)])
    np.testing.assert_allclose(prior, np.array([1 / 3, 1 / 3, 1 / 3, 1, 1, 1]) / 4)
