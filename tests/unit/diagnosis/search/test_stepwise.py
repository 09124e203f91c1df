"""What a law gains beside others and is granted, and which sets the search reaches: each against its formula."""

from dataclasses import replace

import numpy as np
import pytest
from problems import design, evidences, law, planted, search, unknown

from nnhydro.diagnosis.constants import FEW_NATS, LEAVES, MOST_EFFECTS
from nnhydro.diagnosis.model.sizes import nats_of_sizes
from nnhydro.diagnosis.search.scored_set import IMPOSSIBLE, imitated_nats


def test_the_first_law_gains_what_the_evidence_with_the_unknown_says_and_no_more():
    one = planted()
    now, then = one.score(()), one.score((0,))
    assert now.unknown_nats - then.unknown_nats > 1
    before, after = (evidences(one, scored.chosen)[0] - nats_of_sizes(one.whitened, scored.fit, scored.sizes) for scored in (now, then))
    assert one.gain(now, then) == pytest.approx(after - before + one.view.library.log_prior(0), abs=1e-4)


def test_beside_other_laws_a_law_gains_the_difference_of_the_scores():
    one = planted((0.5, 0.4))
    now, then = one.score((0,)), one.score((0, 1))
    assert now.unknown_nats != pytest.approx(then.unknown_nats, abs=0.1)
    assert one.gain(now, then) == then.score - now.score


@pytest.mark.parametrize(("gain", "left", "admitted"), [
    (5.0, LEAVES * 105.0, True), (5.0, LEAVES * 105.0 + 0.1, False), (-0.1, 0.0, False), (0.0, 0.0, False),
    (5.0, 100.0, False), (99.0, 100.0, False), (101.0, 100.0, True),
])
def test_a_law_is_admitted_that_gains_and_leaves_the_unknown_half_at_most_of_what_there_was_to_explain(gain, left, admitted):
    one = planted()
    now = replace(one.score((0,)), unknown_nats=100.0, score=10.0)
    then = replace(one.score((0, 1)), unknown_nats=left, score=10.0 + gain)
    assert one.admits(now, then) == admitted


def test_in_a_part_that_was_chosen_for_its_gain_the_gain_counts_nothing():
    one = planted()
    now, then = (replace(one.score(x), unknown_nats=100.0, score=s) for x, s in (((0,), 0.0), ((0, 1), 300.0)))
    assert one.share_left(now, then) == pytest.approx(100.0 / 400.0)
    h = one.view.library.hypotheses[1]
    object.__setattr__(h, "activity", object())
    try:
        assert one.share_left(now, then) == pytest.approx(1.0)
    finally:
        object.__setattr__(h, "activity", None)


def test_where_hardly_anything_is_left_to_the_unknown_nothing_need_be_taken_from_it():
    one = planted()
    now, then = (replace(one.score(x), unknown_nats=0.9 * FEW_NATS, score=s) for x, s in (((0,), 0.0), ((0, 1), 5.0)))
    assert one.admits(now, then)
    assert not one.admits(now, replace(then, unknown_nats=1.1 * FEW_NATS))


@pytest.mark.parametrize("standard", [True, False])
def test_a_small_standard_term_beside_a_large_unknown_is_asked_for_no_more_than_its_own(standard):
    laws = (law("small", standard=standard), law("other"))
    of = design(4, groups=8, rows=60, noise=0.05)
    smooth = unknown(of).Phi
    X = np.random.default_rng(2).standard_normal((*of.y.shape, 2))
    X[..., 0] = smooth[:, :2]
    of.y = of.y + 0.05 * X[..., 0] + smooth[:, ::-1][:, :2]
    one = search(of, laws, X, level=0.05**2)
    now, then = one.score(()), one.score((0,))
    before, after = (one.nats_of_unknown(scored, [0]) for scored in (now, then))
    assert after > 0.5 * before
    theirs = imitated_nats(one.view, then, 0) if standard else before
    left = max(theirs - (before - after), 0.0)
    assert theirs < before or not standard
    assert max(one.share_left(now, then), 0.0) == pytest.approx(left / (theirs + max(one.gain(now, then), 0.0)))
    assert (one.share_left(now, then) <= LEAVES) == standard


def test_those_that_gain_most_are_found_whether_the_unknown_is_on_or_off():
    one = planted((0.5, 0.4, 0.3))
    base = one.score((0,))
    assert one.most_gaining(base, [1, 2, 3], most=1) == [1]
    assert set(one.most_gaining(base, [3, 2, 1], most=2)) >= {1, 2}


def test_of_laws_that_gain_as_much_the_more_probable_one_is_fitted():
    laws = (law("rare"), *(law("rare") for _ in range(30)), law("plain"))
    of = design(3, groups=8, rows=30)
    column = np.random.default_rng(1).standard_normal((*of.y.shape, 1))
    X = np.concatenate([column, np.random.default_rng(2).standard_normal((*of.y.shape, 30)), column], axis=2)
    of.y = of.y + 0.5 * column[..., 0]
    one = search(of, laws, X)
    assert one.most_gaining(one.score(()), [0, 31], most=1) == [31]
    assert one.screen((), most=1) == [31]
    assert one.run().chosen == (31,)


def test_a_member_without_which_the_set_is_more_probable_is_dropped_again():
    one = planted((0.5,), smooth=0.0)
    too_many = one.score((0, 2, 3))
    assert too_many.score < one.score((0,)).score
    assert one.climb(too_many).chosen == (0,)


def test_a_law_is_swapped_for_one_that_explains_more():
    of = design(3, groups=8, rows=30)
    rng = np.random.default_rng(4)
    right = rng.standard_normal((*of.y.shape, 1))
    alike = 0.9 * right + 0.45 * rng.standard_normal(right.shape)
    of.y = of.y + 0.8 * right[..., 0]
    laws = (law("alike", family="friction"), law("right", family="friction"))
    one = search(of, laws, np.concatenate([alike, right], axis=2))
    assert one.score((1,)).score > one.score((0,)).score > one.score(()).score
    assert one.climb(one.score((0,))).chosen == (1,)


@pytest.mark.parametrize(("cause", "both"), [("", False), ("gap", True)])
def test_laws_of_one_cause_exclude_each_other_and_other_causes_of_the_family_do_not(cause, both):
    of = design(3, groups=8, rows=30)
    X = np.random.default_rng(4).standard_normal((*of.y.shape, 2))
    of.y = of.y + X.sum(axis=2)
    one = search(of, (law("spring", family="transmission"), law("gap", family="transmission", cause=cause)), X)
    assert (one.run().chosen == (0, 1)) == both


@pytest.mark.parametrize("rough", [True, False])
def test_a_rough_start_of_a_settled_instrument_is_not_screened_again(rough):
    of = design(3, groups=8, rows=30)
    X = np.random.default_rng(4).standard_normal((*of.y.shape, 1))
    of.y = of.y + X[..., 0]
    one = search(of, (law("late", rough=rough, working_model=object()),), X)
    assert one.screen(()) == [0]
    assert replace(one, settled=frozenset({("late", 0)})).screen(()) == ([] if rough else [0])


def test_no_set_holds_more_effects_than_an_explanation_may():
    laws = tuple(law(f"law_{k}") for k in range(MOST_EFFECTS + 3))
    of = design(40, groups=6, rows=40)
    X = np.random.default_rng(41).standard_normal((*of.y.shape, len(laws)))
    of.y = of.y + X.sum(axis=2)
    assert len(search(of, laws, X).run().chosen) == MOST_EFFECTS


def test_a_law_with_a_phase_of_each_recording_s_own_is_screened_with_what_its_bounds_grant():
    """Within narrow bounds its values are more probable than the prior of a law without bounds says: else chance comes first."""
    rng = np.random.default_rng(0)
    of = design(0, groups=8, rows=60, noise=0.06)
    others = [law(f"law_{k}") for k in range(9)]
    X = rng.standard_normal((*of.y.shape, 10))
    of.y = of.y + 0.010 * X[..., 9]
    bounded = law("phased", per_recording=True, limits=((-0.03, 0.03),))
    one = search(of, (*others, bounded), X, level=0.06**2)
    assert 9 in one.screen(())
    assert one.gain(one.score(()), one.score((9,))) > max(one.gain(one.score(()), one.score((k,))) for k in range(9))
    assert 9 not in search(of, (*others, replace(bounded, limits=((-3.0, 3.0),))), X, level=0.06**2).screen(())


def test_beside_what_is_impossible_alone_a_law_gains_what_it_gains_beside_nothing():
    """A grip whose breakaway would be negative without the viscous friction beside it: it was granted a million nats."""
    of = design(3, groups=8, rows=60, noise=0.2)
    e, b = np.random.default_rng(4).standard_normal((2, *of.y.shape))
    X = np.stack([e - b, b], axis=-1)
    of.y = of.y + X @ np.array([1.0, 0.3])
    one = search(of, (law("viscous"), law("grip", sense=lambda values: values[0] > 0)), X, level=0.04)
    both, grip, nothing = one.score((0, 1)), one.score((1,)), one.score(())
    assert grip.score < IMPOSSIBLE / 2
    assert both.score > nothing.score
    assert one.gain(grip, both) == pytest.approx(one.gain(nothing, both))
    assert one.gain(nothing, grip) < IMPOSSIBLE / 2
