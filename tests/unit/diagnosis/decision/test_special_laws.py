"""A special law gives way to the plain one of its cause where it takes no more, where its values are those of the plain one, or fails."""

import numpy as np
from problems import design, law, search, special_beside_plain

from nnhydro.diagnosis.decision import decide as decision
from nnhydro.diagnosis.decision.decide import decide
from nnhydro.diagnosis.decision.special_laws import replace_special_laws, with_plainer_law


def test_a_law_that_explains_more_than_the_plain_one_stays():
    one, found = special_beside_plain(lambda values: True)
    assert found.score > one.score((0,)).score + 10
    assert replace_special_laws(one, found).chosen == (1,)


def test_a_law_whose_told_values_are_those_of_the_plain_one_gives_way_to_it():
    told = [False]
    one, found = special_beside_plain(lambda values: not told[0])
    told[0] = True  # the values of the fit without the unknown make no sense for it
    assert replace_special_laws(one, found).chosen == (0,)


def test_a_special_law_that_fails_leaves_its_place_to_the_plain_one(monkeypatch):
    one, found = special_beside_plain(lambda values: True)
    assert with_plainer_law(one, found, 1).chosen == (0,)
    assert decide(one, found, 0).claimed.chosen == (1,)
    monkeypatch.setattr(decision, "listed_probability", lambda search, found, k: 0.9 if k == 0 else 0.1)
    assert decide(one, found, 0).claimed.chosen == (0,)


def test_a_law_without_a_plainer_one_leaves():
    of = design(0, groups=8, rows=30)
    X = np.random.default_rng(50).standard_normal((*of.y.shape, 2))
    of.y = of.y + X @ [1.0, 1.0]
    one = search(of, (law("first"), law("other")), X)
    assert with_plainer_law(one, one.score((0, 1)), 1).chosen == (0,)
