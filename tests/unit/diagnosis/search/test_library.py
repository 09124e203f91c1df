"""The library of candidates: columns in shares of the torque, prior odds, and the mass of the prior within physical bounds."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problems import design, law, library, search

from nnhydro.diagnosis.constants import LEAST_GAIN, RELEVANT, RHO
from nnhydro.diagnosis.problem.activity import ActivityWindow, Sector
from nnhydro.diagnosis.search.library import COLUMNS_AT_A_TIME, Library, bound_bonus, log_mass


def test_friction_is_probable_other_standard_terms_of_a_joint_as_probable_as_not_and_any_other_law_one_in_all_keys():
    laws = (law("offset", standard=True), law("a"), law("friction", standard=True, everywhere=True))
    made = library(design(0), laws)
    assert made.log_prior(0) == 0.0
    assert made.log_prior(1) == pytest.approx(-np.log(len(laws)))
    assert made.log_prior(2) == LEAST_GAIN
    unfelt = replace(made, scale=np.array([1.0, 1.0, 0.0]))  # by a joint that is held
    assert (unfelt.log_prior(1), unfelt.log_prior(2)) == (pytest.approx(-np.log(2)), -np.inf), "what cannot show is not tried"
    in_a_part = replace(laws[2], activity=ActivityWindow(("run0",), until=True))
    assert library(design(0), (*laws[:2], in_a_part)).log_prior(2) == pytest.approx(-LEAST_GAIN - np.log(6))


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


def of_columns(X, laws):
    """A library of the columns X (n, joints, k) beside a design of random rows."""
    of = design(2, joints=X.shape[1])
    return Library.of_columns(of, laws, X.copy())


def test_a_value_of_one_makes_the_torque_s_rms_at_the_joint_where_a_law_weighs_most():
    X = np.random.default_rng(0).standard_normal((60, 2, 2)) * [[3.0, 40.0], [1.0, 500.0]]
    made = of_columns(X, (law("a"), law("b")))
    rms = np.sqrt((made.parts[0] ** 2).sum(axis=0) / made.design.duration) / made.design.scale[:, None]
    np.testing.assert_allclose(rms.max(axis=0), 1.0)
    np.testing.assert_allclose(made.parts[0], X * made.scale, err_msg="the scale turns values of the effect into shares")


def test_where_the_baseline_leaves_the_whole_torque_a_value_of_one_makes_as_much_more_of_it():
    of, X = design(2), np.random.default_rng(0).standard_normal((60, 2, 1)) * [[3.0], [1.0]]
    usual = Library.of_columns(of, (law("a"),), X.copy())
    of.left = np.array([1 / RHO, 1.0])
    bare = Library.of_columns(of, (law("a"),), X.copy())
    rms = np.sqrt((X[..., 0] ** 2).sum(axis=0) / of.duration) / of.scale
    assert usual.scale[0] == pytest.approx(1 / rms.max())
    assert bare.scale[0] == pytest.approx(1 / max(rms[0] * RHO, rms[1]))


@pytest.mark.parametrize(("most", "empty"), [(0.9 * RELEVANT, True), (1.1 * RELEVANT, False)])
def test_a_law_that_can_move_no_relevant_torque_within_its_bounds_is_no_candidate(most, empty):
    X = np.ones((60, 2, 1)) * [[1.0], [0.0]]
    made = of_columns(X, (law("a", limits=((-most, most),)),))
    assert (not made.parts[0].any()) == empty


def test_bounds_are_those_of_the_effect_in_shares_of_the_torque():
    made = of_columns(4.0 * np.ones((60, 1, 1)), (law("a", limits=((0.0, 2.0),)),))
    low, high = made.bounds(0)
    assert (low[0], high[0]) == (0.0, pytest.approx(8.0)), "2 of an effect of 4 N m a unit"


def test_columns_of_a_grown_library_are_found_in_whatever_part_they_lie():
    of, widths = design(4), (1, 2, 1, 3, 1)
    laws = [law(f"w{i}", width) for i, width in enumerate(widths)]
    X = np.arange(8.0) + np.zeros((*of.y.shape, 8))
    first, more = (Library(of, tuple(laws[at]), (X[..., where],), np.ones(X[..., where].shape[2]))
                   for at, where in ((slice(0, 3), slice(0, 4)), (slice(3, 5), slice(4, 8))))
    grown = first.with_more(more)
    assert [grown.columns(k)[0, 0].tolist() for k in range(5)] == [[0], [1, 2], [3], [4, 5, 6], [7]]
    runs = [(run, columns.shape[2]) for run, columns in grown.runs([0, 1, 2, 3, 4])]
    assert runs == [([0, 1, 2], 4), ([3, 4], 4)], "a run lies in one part"


def test_runs_hold_neighbours_and_not_many_more_columns_than_are_multiplied_at_a_time():
    of = design(4, groups=1, rows=2)
    count = 2 * COLUMNS_AT_A_TIME + 10
    made = library(of, [law(f"l{k}") for k in range(count)])
    sizes = [len(run) for run, _ in made.runs([k for k in range(count) if k != 5])]
    assert sum(sizes) == count - 1
    assert max(sizes) <= COLUMNS_AT_A_TIME
    assert sizes[0] == 5, "a gap ends a run"


@pytest.mark.parametrize(("window", "parts"), [
    (ActivityWindow(("run2", "run3"), since=True), 6), (ActivityWindow(("run0",), until=True), 6),
    (ActivityWindow(("run0", "run2")), 4 * 6), (ActivityWindow(sector=Sector(1, 0.0, 1.0)), 36)])
def test_that_a_law_acts_in_a_part_only_is_as_improbable_as_a_claim_without_the_least_gain_shared_between_all_parts(window, parts):
    made = library(design(0), (law("a"), law("a", activity=window)))
    assert made.log_prior(0) - made.log_prior(1) == pytest.approx(LEAST_GAIN + np.log(parts))
