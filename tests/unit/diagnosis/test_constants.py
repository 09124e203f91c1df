"""Constants of the decision: the arithmetic in their reasons is right, and each stands in a test of what it does."""

import ast
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2, expon

from nnhydro.diagnosis import constants
from nnhydro.diagnosis.constants import DETECTED, FORM, LEAST_GAIN, NU, NULL_DRAWS, NULL_QUANTILE, RELEVANT
from nnhydro.diagnosis.decision.alternative_laws import EQUIVALENT_COSINE

NAMES = sorted(name for name in vars(constants) if name.isupper())


def imported(path):
    """What a test file imports from the file of constants."""
    return {alias.name for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.ImportFrom) and node.module == constants.__name__ for alias in node.names}


TESTED = set().union(*(imported(path) for path in Path(__file__).parent.rglob("test_*.py")))


@pytest.mark.parametrize("name", NAMES)
def test_a_unit_test_says_what_a_constant_does(name):
    assert name in TESTED


@pytest.mark.parametrize(("nats", "odds"), [(LEAST_GAIN, 20), (DETECTED, 1e7)])
def test_nats_are_the_odds_that_their_reason_states(nats, odds):
    assert np.exp(nats) == pytest.approx(odds, rel=0.15)


def test_the_variance_of_so_many_observations_is_known_to_a_factor_of_2():
    low, high = chi2.ppf([0.1, 0.9], NU) / NU
    assert 1 / high == pytest.approx(0.5, abs=0.12)
    assert 1 / low == pytest.approx(2.0, abs=0.4)


def test_the_quantile_of_so_many_draws_is_known_to_about_half_a_nat():
    gains = expon.rvs(scale=0.5, size=(4000, NULL_DRAWS), random_state=0)  # half of a chi-squared of two: the tail of any one gain
    assert np.std(np.quantile(gains, NULL_QUANTILE, axis=1)) == pytest.approx(0.4, abs=0.15)


def test_two_laws_of_one_truth_are_alike_where_each_is_off_by_its_form():
    rng = np.random.default_rng(0)
    truth, error = np.linalg.qr(rng.standard_normal((200, 2)))[0].T
    a, b = truth + FORM * error, truth - FORM * error
    cosine = a @ b / (np.linalg.norm(a) * np.linalg.norm(b))
    assert cosine == pytest.approx(EQUIVALENT_COSINE, abs=FORM**3)


def test_what_is_relevant_lies_above_the_error_of_the_numerics_and_below_that_of_a_form():
    assert constants.MODEL_ERROR < RELEVANT < FORM**2
