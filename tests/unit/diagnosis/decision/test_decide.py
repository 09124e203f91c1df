"""Search and decision on random columns: what is planted is claimed for a reason that is told, chance is not, bounds are kept."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from problems import EIGHT, columns, design, law, search, unknown, with_planted

from nnhydro.diagnosis.constants import FORM, LEAST_GAIN, LEAVES, NULL_DRAWS, NULL_QUANTILE, PRECISE, RELEVANT
from nnhydro.diagnosis.decision import decide as deciding
from nnhydro.diagnosis.decision.decide import decide, torque_shares
from nnhydro.diagnosis.decision.null_draws import null_gains, null_threshold
from nnhydro.diagnosis.problem.activity import ActivityWindow


def test_a_planted_law_is_claimed_and_nothing_else():
    for seed in range(3):
        one = with_planted([0.6], seed)
        decided = decide(one, one.run(), 0)
        assert decided.claimed.chosen == (0,)
        (decision,) = [d for d in decided.decisions if d.claimed]
        assert (decision.effect, decision.joint) == ("law_0", 0)
        assert decision.statistic > decision.threshold >= LEAST_GAIN
        assert "nats" in decision.reason


@pytest.mark.parametrize(("share", "claimed"), [(LEAVES - 0.01, (0,)), (LEAVES + 0.01, ())])
def test_a_wave_that_other_frequencies_explain_half_as_much_is_not_claimed(share, claimed, monkeypatch):
    one = with_planted([0.6])
    monkeypatch.setattr(deciding, "share_elsewhere", lambda search, rest, k: share)
    decided = decide(one, one.score((0,)), 0)
    assert decided.claimed.chosen == claimed
    assert claimed or decided.decisions[0].reason == "no line: another frequency explains 51 % as much"


def test_two_planted_laws_are_claimed_whatever_their_order():
    one = with_planted([0.5, -0.4])
    assert decide(one, one.run(), 0).claimed.chosen == (0, 1)


@pytest.mark.slow
def test_laws_that_take_little_from_the_unknown_one_by_one_are_found_together_beside_what_is_in_no_card():
    for seed in range(3):
        rng = np.random.default_rng(100 + seed)
        of = design(seed, groups=8, rows=60, noise=0.02)
        smooth = unknown(of).Phi
        X = np.einsum("nm,mjk->njk", smooth, rng.standard_normal((smooth.shape[1], 2, len(EIGHT))))
        X /= np.sqrt((X**2).mean(axis=(0, 1)))
        of.y = of.y + X[..., :5] @ np.array([0.5, -0.5, 0.5, -0.5, 0.5]) + 0.1 * smooth[:, :2]
        one = search(of, EIGHT, X, level=0.02**2)
        alone = [one.score((k,)).unknown_nats / one.score(()).unknown_nats for k in range(5)]
        assert np.median(alone) > LEAVES, "hardly a law is plain alone"
        assert decide(one, one.run(), 0).claimed.chosen == (0, 1, 2, 3, 4)


def test_what_another_joint_holds_does_not_silence_a_law_that_takes_all_of_its_own():
    of = design(4, groups=8, rows=60, noise=0.02)
    smooth = unknown(of).Phi
    X = np.zeros((*of.y.shape, len(EIGHT)))
    X[:, 0] = smooth @ np.random.default_rng(7).standard_normal((smooth.shape[1], len(EIGHT)))
    X /= np.sqrt((X**2).mean(axis=(0, 1)))
    of.y = of.y + 0.3 * X[..., 0]
    of.y[:, 1] += 6.0 * np.tanh(smooth[:, 0]) * smooth[:, 4]
    one = search(of, EIGHT, X, level=0.02**2)
    none, alone = one.score(()), one.score((0,))
    assert alone.unknown_nats > LEAVES * none.unknown_nats, "most remains, at the other joint"
    assert one.nats_of_unknown(alone, [0]) < 0.1 * one.nats_of_unknown(none, [0])
    assert one.nats_of_unknown(none, [0]) + none.fit.log_evidence > alone.fit.log_evidence - alone.unknown_nats
    assert decide(one, one.run(), 0).claimed.chosen == (0,)


def test_the_least_probable_of_what_is_no_listed_cause_leaves_before_what_gains_less(monkeypatch):
    """Beside the wrong law 0, law 1 has the wrong form, too: it would leave with it, if it left first."""
    one = with_planted([0.5, -0.3])
    probable = {(0, 1): {0: 0.05, 1: 0.4}, (0,): {0: 0.05}, (1,): {1: 0.9}}
    monkeypatch.setattr(deciding, "listed_probability", lambda search, found, k: probable[found.chosen][k])
    both = one.score((0, 1))
    assert one.gain(one.score((1,)), both) > one.gain(one.score((0,)), both)
    assert decide(one, both, 0).claimed.chosen == (1,)


def test_what_imitates_a_cause_leaves_before_it_where_the_cause_alone_explains_more(monkeypatch):
    """Law 0 is the cause; law 1 imitates it in part, and beside law 1 the size of law 0 differs between recordings."""
    of = design(3, groups=8, rows=30)
    X = columns(of)
    X[..., 1] = X[..., 0] + 0.8 * X[..., 3]
    of.y = of.y + 0.6 * X[..., 0] + 0.1 * X[..., 3]
    one = search(of, EIGHT, X)
    monkeypatch.setattr(deciding, "listed_probability", lambda search, found, k: 0.1 if k == 0 and len(found.chosen) > 1 else 1.0)
    decided = decide(one, one.score((0, 1)), 0)
    assert decided.claimed.chosen == (0,)
    reasons = {d.effect: d.reason for d in decided.decisions if not d.claimed}
    assert reasons == {"law_1": deciding.EXPLAINED}


def test_a_small_law_without_which_claims_fall_is_no_error_of_their_form(monkeypatch):
    """Law 1 gains less than an error in the form of law 0 might, but without it law 0 is no probable cause."""
    one = with_planted([0.6, 0.3])
    monkeypatch.setattr(deciding, "form_bars", lambda search, now, rests: [1e9 if k == 1 and 0 in now.chosen else 0.0 for k in now.chosen])
    assert decide(one, one.score((0, 1)), 0).claimed.chosen == (0,)
    monkeypatch.setattr(deciding, "listed_probability", lambda search, found, k: 0.1 if found.chosen == (0,) else 1.0)
    assert decide(one, one.score((0, 1)), 0).claimed.chosen == (0, 1)


def test_a_member_that_is_not_admitted_leaves_the_others_standing():
    of = design(2, groups=8, rows=60, noise=0.02)
    smooth = unknown(of).Phi
    X = np.einsum("nm,mjk->njk", smooth, np.random.default_rng(5).standard_normal((smooth.shape[1], 2, len(EIGHT))))
    X[..., 3:] = columns(of, len(EIGHT) - 3)  # no functions of the state: they take nothing from the unknown
    X /= np.sqrt((X**2).mean(axis=(0, 1)))
    of.y = of.y + X[..., :4] @ np.array([0.5, -0.5, 0.5, 0.02]) + 0.2 * smooth[:, :2] ** 2
    one = search(of, EIGHT, X, level=0.02**2)
    full = one.score((0, 1, 2, 3))
    assert full.score > one.score((0, 1, 2)).score
    assert not one.admits(one.score((0, 1, 2)), full)
    assert set(one.climb(full).chosen) == {0, 1, 2}


def test_a_law_whose_values_make_no_sense_together_is_not_claimed():
    laws = (law("law_0", sense=lambda values: values[0] < 0), *EIGHT[1:])
    one = with_planted([0.6], laws=laws)
    assert decide(one, one.run(), 0).claimed.chosen == ()
    one = with_planted([-0.6], laws=laws)
    assert decide(one, one.run(), 0).claimed.chosen == (0,)


def test_noise_alone_is_left_alone():
    assert [with_planted([], seed).run().chosen for seed in range(5)].count(()) >= 4
    assert all(decide(one := with_planted([], seed), one.run(), 0).claimed.chosen == () for seed in range(5))


def test_the_largest_gain_of_chance_stays_below_its_threshold_in_99_of_100_campaigns():
    above, of = 0, 100
    for seed in range(of):
        one = with_planted([], seed + 1000)
        empty = one.score(())
        largest = max(one.view.gains((), empty.fit) + np.array([one.view.library.log_prior(k) for k in range(len(EIGHT))]))
        above += largest > null_threshold(one, empty, seed)
    assert above <= 5, f"{above} of {of}: one is expected, more than 5 in 1 of 1,500 tests"


def test_draws_of_the_null_have_the_mean_that_gains_have_under_it():
    one = with_planted([], 3)
    drawn = null_gains(one, one.score(()), 0)
    assert len(drawn) == NULL_DRAWS
    assert null_threshold(one, one.score(()), 0) == pytest.approx(np.quantile(drawn, NULL_QUANTILE))
    seen = []
    for seed in range(60):
        other = with_planted([], seed + 2000)
        prior = np.array([other.view.library.log_prior(k) for k in range(len(EIGHT))])
        seen.append((other.view.gains((), other.score(()).fit) + prior).max())
    spread = np.sqrt(np.var(drawn) / len(drawn) + np.var(seen) / len(seen))
    assert abs(np.mean(seen) - drawn.mean()) < 4 * spread


def test_more_laws_that_could_gain_by_chance_raise_the_threshold():
    few, many = (with_planted([], 5, laws=tuple(law(f"law_{k}") for k in range(count))) for count in (2, 60))
    prior = [candidates.view.library.log_prior(0) for candidates in (few, many)]
    assert null_threshold(many, many.score(()), 0) - prior[1] > null_threshold(few, few.score(()), 0) - prior[0]


@pytest.mark.parametrize(("value", "claimed"), [(0.6, True), (-0.6, False)])
def test_a_value_beyond_its_physical_bounds_is_not_claimed(value, claimed):
    one = with_planted([value], laws=(law("law_0", limits=((0.0, np.inf),)), *EIGHT[1:]))
    assert (0 in decide(one, one.run(), 0).claimed.chosen) == claimed


@pytest.mark.parametrize(("noise", "claimed"), [(0.02, ()), (1e-4, (0,))])
def test_what_hardly_moves_the_torque_is_claimed_only_where_it_makes_much_of_what_remains(noise, claimed):
    of = design(1, groups=400, rows=30, noise=noise)
    X = columns(of)
    of.y = of.y + 0.5 * RELEVANT * X[..., 0]
    one = search(of, EIGHT, X, level=noise**2)
    decided = decide(one, one.score((0,)), 0)
    assert decided.claimed.chosen == claimed
    if not claimed:
        assert f"({100 * RELEVANT:.2f} % needed)" in decided.decisions[0].reason


def test_less_than_the_form_of_the_largest_claim_is_not_claimed_beside_it():
    of = design(1, groups=8, rows=30, noise=1e-4)
    X = columns(of)
    of.y = of.y + 0.8 * X[..., 0] + 0.3 * FORM * X[..., 1]
    one = search(of, EIGHT, X, level=1e-8)
    assert decide(one, one.score((0, 1)), 0).claimed.chosen == (0,)
    assert torque_shares(one, one.score((0, 1)))[1] == pytest.approx(0.3 * FORM, rel=0.1)


def test_a_value_that_might_as_well_be_0_is_not_claimed():
    one = with_planted([0.02], 6)
    decided = decide(one, one.score((0,)), 0)
    assert decided.claimed.chosen == ()
    values = one.score((0,))
    at = values.places(one.view)[0]
    sd = float(np.sqrt(values.fit.covariance(np.array([at.start]))[0, 0]))
    assert abs(float(values.fit.mean[at][0])) < PRECISE * sd


def test_what_may_be_the_form_of_another_is_judged_once_that_one_has_been(monkeypatch):
    one = with_planted([0.5, 0.45], laws=(law("law_0", predictable_share=0.0), *EIGHT[1:]))
    both = one.score((0, 1))
    alone = decide(one, both, 0)
    assert alone.claimed.chosen == (0,), "all of the other may be the form of what can be predicted in no part"
    monkeypatch.setattr(deciding, "says_nothing", lambda search, now, k: k == 0)
    assert decide(one, both, 0).claimed.chosen == (1,)


@pytest.mark.parametrize("fails", [0, 1])
def test_of_two_laws_that_explain_the_same_the_one_that_is_possible_is_claimed(fails, monkeypatch):
    """Each gains little beside the other: whichever leaves first, the impossible one must not take the other with it."""
    of = design(0, groups=8, rows=30)
    X = columns(of, len(EIGHT))
    X[..., 1] = X[..., 0] + 0.02 * X[..., 1]
    of.y = of.y + 0.3 * (X[..., 0] + X[..., 1])
    one = search(of, EIGHT, X)
    both = one.score((0, 1))
    assert all(one.gain(one.score((k,)), both) < LEAST_GAIN for k in (0, 1))
    possible = deciding.values_of
    monkeypatch.setattr(deciding, "values_of", lambda search, now, k: replace(possible(search, now, k), bounded=k == fails))
    assert decide(one, both, 0).claimed.chosen == (1 - fails,)


def test_a_member_that_gains_little_beside_a_claimed_one_is_not_judged_without_it():
    of = design(0, groups=8, rows=30)
    X = columns(of, len(EIGHT))
    X[..., 1] = X[..., 0] + 0.3 * X[..., 1]
    of.y = of.y + 0.6 * X[..., 0]
    one, known = search(of, EIGHT, X), {}
    assert decide(one, one.score((0, 1)), 0, known=known).claimed.chosen == (0,)
    assert {chosen for chosen, *_ in known} == {(0, 1), (0,)}


def test_every_member_that_fails_is_told_with_the_first_test_that_it_fails():
    one = with_planted([0.6], 2)
    decided = decide(one, one.score((0, 4, 5)), 0)
    assert decided.claimed.chosen == (0,)
    dropped = [d for d in decided.decisions if not d.claimed]
    assert {d.effect for d in dropped} == {"law_4", "law_5"}
    assert all(d.statistic <= d.threshold and d.reason for d in dropped)
    assert set(decided.shares) == {0}
    assert decided.decisions[0].document()["joint"] is None


@pytest.mark.slow
@given(seed=st.integers(0, 300))
@settings(max_examples=10)
def test_a_search_never_ends_below_the_empty_set_and_is_the_same_each_time(seed):
    one = with_planted([0.15 * (seed % 4)], seed)
    best = one.run()
    assert best.score >= one.score(()).score
    assert best.unknown_nats >= 0
    assert with_planted([0.15 * (seed % 4)], seed).run().chosen == best.chosen
    assert len(one.occupied_places(best.chosen)) == len(best.chosen), "one law of a family at a place"


@pytest.mark.parametrize(("own", "claimed"), [(1.0, False), (0.0, True)])
def test_what_has_values_of_each_recording_s_own_is_no_wave_where_the_recordings_own_masses_gain_more(own, claimed):
    """A wave that each recording holds in another size, or a mass of each recording's own that it resembles."""
    rng, groups = np.random.default_rng(5), 8
    of = design(4, groups=groups, rows=40, noise=0.1)
    size = np.repeat(rng.standard_normal(groups), 40)[:, None]
    wave = rng.standard_normal(of.y.shape)
    resembles = of.Y[..., 0] + wave
    of.y = of.y + size * (own * of.Y[..., 0] + (1 - own) * resembles)
    X = np.concatenate([resembles[..., None], rng.standard_normal((*of.y.shape, 2))], axis=2)
    one = search(of, (law("wave", per_recording=True), *EIGHT[:2]), X, level=0.1**2)
    told = decide(one, one.score((0,)), 0)
    assert (told.claimed.chosen == (0,)) is claimed
    assert claimed or "fitted to each recording alone would gain more" in told.decisions[0].reason


@pytest.mark.parametrize(("own", "claimed"), [(1.0, False), (0.0, True)])
def test_what_acts_in_some_recordings_is_no_law_where_the_recordings_own_masses_gain_more(own, claimed):
    """A law that acts in recordings 0 and 3, or masses of the recordings' own that it resembles there."""
    rng, groups = np.random.default_rng(6), 8
    of = design(4, groups=groups, rows=40, noise=0.1)
    acts = np.isin(of.problem.group_of, (0, 3))[:, None]
    resembles = of.Y[..., 0] + rng.standard_normal(of.y.shape)
    size = np.repeat(np.concatenate([[1.0, -0.6, 0.5, 1.0], rng.standard_normal(4)]), 40)[:, None]
    of.y = of.y + own * size * of.Y[..., 0] + (1 - own) * acts * resembles
    X = np.concatenate([(acts * resembles)[..., None], rng.standard_normal((*of.y.shape, 2))], axis=2)
    one = search(of, (law("pump", activity=ActivityWindow(("run0", "run3"))), *EIGHT[:2]), X, level=0.1**2)
    told = decide(one, one.score((0,)), 0)
    assert (told.claimed.chosen == (0,)) is claimed
    assert claimed or "fitted to each recording alone would gain more" in told.decisions[0].reason
