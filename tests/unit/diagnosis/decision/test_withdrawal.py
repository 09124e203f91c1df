"""Claims that predict nothing are withdrawn, and what was judged beside them is judged again."""

from types import SimpleNamespace

import numpy as np
import pytest
from problems import EIGHT, design, law, search, with_planted

from nnhydro.diagnosis.decision import decide as deciding
from nnhydro.diagnosis.decision import withdrawal
from nnhydro.diagnosis.decision.decide import Claims, Decision, decide
from nnhydro.diagnosis.decision.heldout_errors import HeldoutErrors
from nnhydro.diagnosis.decision.withdrawal import withdraw_useless


def test_what_was_left_out_as_the_form_of_another_comes_back_when_that_is_useless(monkeypatch):
    """The other fails once its error on held-out recordings is known."""
    one = with_planted([0.5, -0.4])
    monkeypatch.setattr(deciding, "form_bars", lambda search, now, rests: [1e9 if k == 1 and 0 in now.chosen else 0.0 for k in now.chosen])
    errors = {(): 1.0, (0,): 1.1, (1,): 0.5}
    monkeypatch.setattr(withdrawal, "measure_errors", lambda search, found, model, seed: HeldoutErrors(
        1.0, errors[found.chosen], {search.key(k): 1.0 for k in found.chosen}, [], [], 1.0, 6))
    decided = decide(one, one.run(), 0)
    assert decided.claimed.chosen == (0,)
    claims, _ = withdraw_useless(one, decided, None, 0)
    assert claims.claimed.chosen == (1,)
    assert sorted((d.effect, d.claimed, d.small) for d in claims.decisions) == [("law_0", False, False), ("law_1", True, False)]


@pytest.mark.parametrize(("after", "small"), [(0.999, True), (1.001, False)])
def test_a_claim_that_lowers_the_error_by_too_little_is_small_and_one_that_raises_it_is_not(monkeypatch, after, small):
    one = with_planted([0.5, 0.0])
    monkeypatch.setattr(withdrawal, "measure_errors", lambda search, found, model, seed: HeldoutErrors(
        1.0, after if found.chosen else 1.0, {search.key(k): 1.0 for k in found.chosen}, [], [], 1.0, 6))
    claims, _ = withdraw_useless(one, decide(one, one.score((0,)), 0), None, 0)
    assert [(d.effect, d.claimed, d.small) for d in claims.decisions] == [("law_0", False, small)]


@pytest.mark.parametrize(("differ", "exempt"), [(0.0, {0}), (1e6, set())], ids=["masses as in every recording", "masses that change"])
def test_a_claim_stays_for_the_sake_of_arm_yaml_only_where_the_masses_are_the_same_in_all_recordings(monkeypatch, differ, exempt):
    one = with_planted([0.5, 0.0])
    claimed = one.score((0,))
    monkeypatch.setattr(withdrawal, "contradicts_arm", lambda search, found: not found.chosen)
    monkeypatch.setattr(withdrawal, "nats_of_parameters_per_recording", lambda search, rest: differ)
    assert withdrawal._exempt_members(one, claimed, None) == exempt


def test_a_claim_that_is_improbable_beside_what_is_left_leaves_with_the_one_that_predicts_nothing(monkeypatch):
    one = with_planted([0.5, -0.4])
    monkeypatch.setattr(deciding, "listed_probability", lambda search, found, k: 0.006 if found.chosen == (1,) else 1.0)
    errors = {(): 1.0, (0,): 0.9, (1,): 0.5, (0, 1): 0.5}
    monkeypatch.setattr(withdrawal, "measure_errors", lambda search, found, model, seed: HeldoutErrors(
        1.0, errors[found.chosen], {search.key(k): errors[tuple(x for x in found.chosen if x != k)] for k in found.chosen}, [], [], 1.0, 6))
    decided = decide(one, one.run(), 0)
    assert decided.claimed.chosen == (0, 1)
    claims, heldout = withdraw_useless(one, decided, None, 0)
    assert (claims.claimed.chosen, heldout.after) == ((), 1.0)
    reasons = {d.effect: d.reason for d in claims.decisions if not d.claimed}
    assert "hardly falls" in reasons["law_0"]
    assert "a cause outside the catalogue is more probable" in reasons["law_1"]


def claim_all(monkeypatch):
    """Whatever is judged again is claimed."""
    monkeypatch.setattr(withdrawal, "decide", lambda search, found, seed: Claims(found, tuple(
        Decision(*search.key(k), 9.0, 3.0, True, "gains 9 nats") for k in found.chosen), dict.fromkeys(found.chosen, 0.1)))


def left_of(errors, monkeypatch):
    """Which of three claims stay where `errors` gives the error on held-out recordings with a set of them."""
    of = design(0, groups=6, rows=20)
    one = search(of, EIGHT[:3], np.random.default_rng(1).standard_normal((*of.y.shape, 3)))

    def measure_errors(search, found, model, seed):
        rest = {search.key(k): errors[tuple(x for x in found.chosen if x != k)] for k in found.chosen}
        return SimpleNamespace(before=errors[()], after=errors[found.chosen], without=rest, unit="recordings")

    monkeypatch.setattr(withdrawal, "measure_errors", measure_errors)
    claim_all(monkeypatch)
    made = tuple(Decision(f"law_{k}", 0, 9.0, 3.0, True, "gains 9 nats") for k in range(3))
    claims, heldout = withdraw_useless(one, Claims(one.score((0, 1, 2)), made, dict.fromkeys(range(3), 0.1)), None, 0)
    assert {d.effect for d in claims.decisions if d.claimed} == {f"law_{k}" for k in claims.claimed.chosen}
    assert heldout.after == errors[claims.claimed.chosen]
    return claims.claimed.chosen


@pytest.mark.parametrize(("third", "stay"), [(0.12, (0, 1, 2)), (0.10, (0, 1)), (0.08, (0, 1))])
def test_a_claim_stays_if_the_error_is_larger_without_it(third, stay, monkeypatch):
    errors = {(): 0.5, (0, 1, 2): 0.10, (1, 2): 0.3, (0, 2): 0.3, (0, 1): third, (1,): 0.4, (0,): 0.4, (2,): 0.4}
    assert left_of(errors, monkeypatch) == stay


def test_claims_that_change_the_error_by_nothing_anybody_would_act_on_are_withdrawn_together(monkeypatch):
    errors = {(): 0.5, (0, 1, 2): 0.499, (1, 2): 0.51, (0, 2): 0.51, (0, 1): 0.51, (1,): 0.5, (0,): 0.5, (2,): 0.5}
    assert left_of(errors, monkeypatch) == ()


@pytest.mark.parametrize(("without", "stay"), [(0.00229, (0, 1)), (0.00241, (0, 1, 2))])
def test_a_claim_that_makes_a_thirtieth_of_the_energy_of_so_small_an_error_is_withdrawn(without, stay, monkeypatch):
    errors = {(): 0.3, (0, 1, 2): 0.00225, (1, 2): 0.2, (0, 2): 0.2, (0, 1): without, (1,): 0.2, (0,): 0.2}
    assert left_of(errors, monkeypatch) == stay


def test_a_useful_claim_stays_where_the_claim_beside_it_spoils_the_prediction(monkeypatch):
    errors = {(): 0.28, (0, 1, 2): 0.32, (1, 2): 0.32, (0, 2): 0.33, (0, 1): 0.31, (1,): 0.29, (0,): 0.21, (2,): 0.4}
    assert left_of(errors, monkeypatch) == (0,)


@pytest.mark.parametrize(("size", "other", "stays"), [(8.0, 0.0, True), (1.0, 0.0, False), (8.0, 8.0, False)])
def test_a_claim_that_lowers_no_error_stays_where_only_without_it_the_masses_are_beyond_belief(size, other, stays, monkeypatch):
    """A law whose torque is that of a parameter of the baseline, with a prior of 9 against 1; `other` moves a parameter that it cannot."""
    Y = design(0).Y
    of = design(0, planted=size * Y[..., 0] + other * Y[..., 1])
    one = search(of, (law("payload"),), 30 * Y[..., :1])
    key = one.key(0)
    monkeypatch.setattr(withdrawal, "measure_errors", lambda search, found, model, seed: SimpleNamespace(
        before=0.1, after=0.1, without={key: 0.1} if found.chosen else {}, unit="recordings"))
    made = Claims(one.score((0,)), (Decision(*key, 9.0, 3.0, True, "gains 9 nats"),), {0: 0.1})
    claims, _ = withdraw_useless(one, made, None, 0)
    assert claims.claimed.chosen == ((0,) if stays else ())
    assert [d.claimed for d in claims.decisions] == [stays]


PHASED, IN_PART = {"per_recording": True}, {"predictable_share": 0.8}  # of a gap four fifths of the energy, or no gap is there


@pytest.mark.parametrize(("card", "fitted", "stay"), [
    ({}, 0.05, (0,)), (PHASED, 0.1, (0, 1)), (PHASED, 0.19, (0,)), (IN_PART, 0.08, (0, 1)), (IN_PART, 0.1, (0,))])
def test_what_wanders_stays_if_it_fits_and_is_predicted_by_nobody(card, fitted, stay, monkeypatch):
    """The error rises with it from 20 to 25 %: other claims go; what fits stays, and the error told is that without it."""
    of = design(0, groups=6, rows=20)
    one = search(of, (law("friction"), law("other", **card)), np.random.default_rng(1).standard_normal((*of.y.shape, 2)))
    errors = {(): 0.5, (0,): 0.2, (1,): 0.45, (0, 1): 0.25}

    def measure_errors(search, found, model, seed):
        rest = {search.key(k): errors[tuple(x for x in found.chosen if x != k)] for k in found.chosen}
        return HeldoutErrors(errors[()], errors[found.chosen], rest, [], [], 1.0, 6)

    monkeypatch.setattr(withdrawal, "measure_errors", measure_errors)
    claim_all(monkeypatch)
    monkeypatch.setattr(withdrawal, "fitted_error", lambda search, found, heldout: fitted if found.chosen == (0, 1) else 0.2)
    made = Claims(one.score((0, 1)), tuple(Decision(*one.key(k), 9.0, 3.0, True, "gains 9 nats") for k in range(2)), {0: 0.1, 1: 0.1})
    claims, heldout = withdraw_useless(one, made, None, 0)
    assert (claims.claimed.chosen, heldout.after) == (stay, 0.2)
    assert heldout.without == {one.key(k): (0.5, 0.2)[k] for k in stay}
