"""A special law gives way to the plain one of its family where it takes no more, or where its values are those of the plain one."""

import numpy as np
import pytest
from problems import design, law, search

from nnhydro.diagnosis.constants import LEAST_GAIN
from nnhydro.diagnosis.findings import equivalence
from nnhydro.diagnosis.findings.equivalence import Rival, replace_by_simpler, replace_special_laws, rivals_of


def fitted(sense):
    """A search in which a special law of two values fits much better than the plain one of its family, and the set with it."""
    of = design(0, groups=8, rows=30)
    X = np.random.default_rng(50).standard_normal((*of.y.shape, 3))
    of.y = of.y + X @ [0.0, 1.0, 1.0]
    X[..., 0] = X[..., 1] + 0.3 * X[..., 2]
    one = search(of, (law("plain", family="friction"), law("special", 2, family="friction", sense=sense)), X)
    return one, one.score((1,))


def test_a_law_that_explains_more_than_the_plain_one_stays():
    one, found = fitted(lambda values: True)
    assert found.score > one.score((0,)).score + 10
    assert replace_special_laws(one, found).chosen == (1,)


def test_a_law_whose_told_values_are_those_of_the_plain_one_gives_way_to_it():
    told = [False]
    one, found = fitted(lambda values: not told[0])
    told[0] = True  # the values of the fit without the unknown make no sense for it
    assert replace_special_laws(one, found).chosen == (0,)


@pytest.mark.parametrize(("gain", "chosen"), [(LEAST_GAIN - 0.1, (1,)), (LEAST_GAIN + 0.1, (0,))])
def test_an_equivalent_of_fewer_values_takes_the_place_only_if_it_gains_enough_to_be_claimed(gain, chosen, monkeypatch):
    one, found = fitted(lambda values: True)
    monkeypatch.setattr(equivalence, "rivals_of", lambda *_: (1.0, [Rival(0, 2.0, 0.1, 0.9, True)]))
    monkeypatch.setattr(type(one), "gain", lambda search, now, then: gain)
    assert replace_by_simpler(one, found).chosen == chosen


def test_a_standard_term_for_which_the_finding_may_be_taken_is_a_rival_however_many_special_laws_gain_more():
    of = design(0, groups=8, rows=60)
    rng = np.random.default_rng(50)
    truth, special = rng.standard_normal((*of.y.shape, 1)), 10
    X = np.concatenate([truth, truth + 0.6 * rng.standard_normal(truth.shape),
                        truth + 0.2 * rng.standard_normal((*of.y.shape, special))], axis=2)
    of.y = of.y + 0.8 * truth[..., 0]
    named = [law("viscous", joint=1, standard=True), law("dry", joint=1, standard=True), *[law(f"special_{i}") for i in range(special)]]
    for alike in (False, True):
        if alike:
            named[0].effect.signature.mistaken_for = ("dry",)
        one = search(of, tuple(named), X)
        _, others = rivals_of(one, one.score((0,)), 0)
        assert len(others) >= 4
        assert (1 in [a.number for a in others]) == alike
        assert len({one.key(a.number) for a in others}) == len(others), "the best law of each effect alone"
