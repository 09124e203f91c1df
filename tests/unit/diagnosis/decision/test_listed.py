"""A name that leaves much of the unknown is less probable than a cause on no card, a special cause more so than a friction."""

import numpy as np
import pytest
from problems import design, law, search, unknown

from nnhydro.diagnosis.constants import FEW_NATS, LISTED, TRUSTED_RATIO
from nnhydro.diagnosis.decision.decide import decide
from nnhydro.diagnosis.decision.listed import listed_probability

OTHERS = tuple(law(f"law_{k}") for k in range(30))


def hidden(rest, standard):
    """A search in which one smooth law acts beside `rest` of a smooth function that is on no card."""
    of = design(4, groups=8, rows=60, noise=0.02)
    smooth = unknown(of).Phi
    rng = np.random.default_rng(7)
    X = rng.standard_normal((*of.y.shape, 1 + len(OTHERS)))
    X[..., 0] = smooth @ rng.standard_normal((smooth.shape[1], 2))
    X /= np.sqrt((X**2).mean(axis=(0, 1)))
    of.y = of.y + 0.3 * X[..., 0] + rest * smooth[:, ::-1][:, :2]
    return search(of, (law("smooth", standard=standard), *OTHERS), X, level=0.02**2)


def left(one):
    """The share that the first law leaves of what the unknown makes of it."""
    return one.share_left(one.score(()), one.score((0,)))


@pytest.mark.parametrize("standard", [True, False])
@pytest.mark.parametrize("rest", [0.01, 0.03, 0.1])
def test_the_probability_falls_with_what_is_left_by_the_odds_of_the_cause(rest, standard):
    one = hidden(rest, standard)
    odds = 1 if standard else 1 + len(OTHERS)
    want = LISTED / (1 + odds * (max(left(one), 0.0) / TRUSTED_RATIO) ** 4)
    assert one.unknown_beside(one.score((0,)), [0]) > FEW_NATS
    assert listed_probability(one, one.score((0,)), 0) == pytest.approx(want)


def test_what_leaves_no_more_than_chance_is_the_cause_as_far_as_any_list_can_tell():
    one = hidden(0.0, standard=False)
    assert listed_probability(one, one.score((0,)), 0) == LISTED


def test_beside_a_third_of_the_unknown_friction_is_told_and_a_special_cause_is_not():
    rest = next(r for r in np.geomspace(0.01, 0.3, 40) if 0.28 < left(hidden(r, standard=False)) < 0.45)
    told = {standard: decide(one, one.score((0,)), 0) for standard in (True, False) for one in [hidden(rest, standard)]}
    assert told[True].claimed.chosen == (0,)
    assert told[False].claimed.chosen == ()
    assert "outside the catalogue" in told[False].decisions[0].reason
