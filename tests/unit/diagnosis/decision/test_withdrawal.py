"""Claims without which held-out recordings are predicted as well are withdrawn, the worst first."""

from types import SimpleNamespace

import numpy as np
import pytest
from problems import design, law, search

from nnhydro.diagnosis.decision import withdrawal
from nnhydro.diagnosis.decision.decide import Claims, Decision

LAWS = tuple(law(f"law_{k}") for k in range(3))


def left_of(errors, monkeypatch):
    """Which of three claims stay where `errors` gives the error on held-out recordings with a set of them."""
    of = design(0, groups=6, rows=20)
    one = search(of, LAWS, np.random.default_rng(1).standard_normal((*of.y.shape, 3)))

    def prove(search, found, model, seed):
        rest = {search.key(k): errors[tuple(x for x in found.chosen if x != k)] for k in found.chosen}
        return SimpleNamespace(before=errors[()], after=errors[found.chosen], without=rest, held_out="recordings")

    monkeypatch.setattr(withdrawal, "prove", prove)
    made = tuple(Decision(f"law_{k}", 0, 9.0, 3.0, True, "gains 9 nats") for k in range(3))
    claims, proof = withdrawal.withdraw_useless(one, Claims(one.score((0, 1, 2)), made, dict.fromkeys(range(3), 0.1)), None, 0)
    assert {d.effect for d in claims.decisions if d.claimed} == {f"law_{k}" for k in claims.claimed.chosen}
    assert proof.after == errors[claims.claimed.chosen]
    return claims.claimed.chosen


@pytest.mark.parametrize(("third", "stay"), [(0.12, (0, 1, 2)), (0.10, (0, 1)), (0.08, (0, 1))])
def test_a_claim_stays_if_the_error_is_larger_without_it(third, stay, monkeypatch):
    errors = {(): 0.5, (0, 1, 2): 0.10, (1, 2): 0.3, (0, 2): 0.3, (0, 1): third, (1,): 0.4, (0,): 0.4, (2,): 0.4}
    assert left_of(errors, monkeypatch) == stay


def test_claims_that_change_the_error_by_nothing_anybody_would_act_on_are_withdrawn_together(monkeypatch):
    errors = {(): 0.5, (0, 1, 2): 0.499, (1, 2): 0.51, (0, 2): 0.51, (0, 1): 0.51, (1,): 0.5, (0,): 0.5, (2,): 0.5}
    assert left_of(errors, monkeypatch) == ()


def test_a_useful_claim_stays_where_the_claim_beside_it_spoils_the_prediction(monkeypatch):
    errors = {(): 0.28, (0, 1, 2): 0.32, (1, 2): 0.32, (0, 2): 0.33, (0, 1): 0.31, (1,): 0.29, (0,): 0.21, (2,): 0.4}
    assert left_of(errors, monkeypatch) == (0,)
