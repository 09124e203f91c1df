"""Members without which other claims fail: one explanation with them, for which it is enough to be more probable than not."""

import numpy as np
import pytest
from problems import design, law, search

from nnhydro.diagnosis.constants import LEAST_GAIN
from nnhydro.diagnosis.decision import decide as deciding
from nnhydro.diagnosis.decision.decide import decide

LAWS = tuple(law(f"law_{k}") for k in range(4))


def with_little_of(size):
    """A search in which law 0 acts, and law 1 with the value `size`."""
    of = design(0, groups=8, rows=30)
    X = np.random.default_rng(50).standard_normal((*of.y.shape, len(LAWS)))
    of.y = of.y + 0.6 * X[..., 0] + size * X[..., 1]
    return search(of, LAWS, X)


@pytest.mark.parametrize(("size", "falls", "claimed"), [(0.17, True, (0, 1)), (0.17, False, (0,)), (0.0, True, ())])
def test_a_law_that_gains_too_little_is_claimed_if_others_fail_without_it_and_it_is_probable(size, falls, claimed, monkeypatch):
    """Law 1 gains less than chance might; without it law 0 is no probable cause where it `falls`."""
    one = with_little_of(size)
    both, alone = one.score((0, 1)), one.score((0,))
    assert (one.gain(alone, both) > 0) == (size > 0)
    monkeypatch.setattr(deciding, "least_gain", lambda library, largest, k: 1e6 if k == 1 else 3.0)
    monkeypatch.setattr(deciding, "listed_probability", lambda search, found, k: 0.1 if falls and found.chosen == (0,) else 1.0)
    decided = decide(one, both, 0)
    assert decided.claimed.chosen == claimed
    if claimed == (0, 1):
        (decision,) = [d for d in decided.decisions if d.effect == "law_1"]
        assert 0 <= decision.threshold < decision.statistic < LEAST_GAIN


@pytest.mark.parametrize(("least", "claimed"), [(0.4, (0, 1)), (0.6, ())])
def test_members_that_only_stand_together_must_gain_the_least_of_each(least, claimed, monkeypatch):
    """Law 0 is no probable cause without law 1: two names, for which twice `least` of what both gain together is needed."""
    one = with_little_of(0.17)
    both = one.score((0, 1))
    monkeypatch.setattr(deciding, "LEAST_GAIN", least * (both.score - one.score(()).score))
    monkeypatch.setattr(deciding, "least_gain", lambda library, largest, k: 1e6 if k == 1 else 3.0)
    monkeypatch.setattr(deciding, "listed_probability", lambda search, found, k: 0.1 if found.chosen == (0,) else 1.0)
    assert decide(one, both, 0).claimed.chosen == claimed


def test_a_member_that_fails_takes_the_place_of_one_that_explains_less():
    """Law 0 acts; law 1 resembles it, law 2 has another torque. Only the higher score counts, and a place is taken once."""
    of = design(0, groups=8, rows=30)
    X = np.random.default_rng(50).standard_normal((*of.y.shape, 3))
    X[..., 1] = X[..., 0] + 0.5 * X[..., 1]
    of.y = of.y + X @ [0.6, 0.0, 0.6]
    one = search(of, tuple(law(f"law_{k}") for k in range(3)), X)
    best, similar, true = one.score((0, 1, 2)), one.score((1, 2)), one.score((0, 2))
    assert true.score > similar.score + LEAST_GAIN
    exchanged = deciding._exchange(one, best, 0, deciding.Claims(similar, (), {}))
    assert exchanged is not None
    assert exchanged.chosen == true.chosen
    assert deciding._exchange(one, best, 1, deciding.Claims(true, (), {})) is None
    assert deciding._exchange(one, best, 0, deciding.Claims(true, (), {})) is None, "it is claimed already"
    assert deciding._exchange(one, similar, 0, deciding.Claims(similar, (), {})) is None, "a set of the same size would be judged for ever"
