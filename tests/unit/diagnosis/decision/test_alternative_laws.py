"""The plain law takes a special one's place where that takes no more, or fails."""

import numpy as np
from problems import design, law, search, special_beside_plain

from nnhydro.diagnosis.decision import decide as decision
from nnhydro.diagnosis.decision.alternative_laws import replace_special_laws, with_narrower_form, with_plainer_law
from nnhydro.diagnosis.decision.decide import decide


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


def test_a_law_with_a_value_beyond_its_bound_leaves_its_place_to_a_narrower_form_of_itself():
    of = design(0, groups=8, rows=30)
    X = np.random.default_rng(50).standard_normal((*of.y.shape, 3))
    X[..., 2] = X[..., 0]  # the wide form has the column of the narrow one, and another
    of.y = of.y + X @ [1.0, 0.4, 0.0]
    laws = law("drag", 2, limits=((-9.0, 9.0), (-0.2, 0.2))), law("drag", 1, limits=((-9.0, 9.0),))
    one = search(of, laws, X)
    assert with_narrower_form(one, one.score((0,)), 0).chosen == (1,)
    decided = decide(one, one.score((0,)), 0)
    assert decided.claimed.chosen == (1,)
    assert with_narrower_form(one, one.score((1,)), 1).chosen == (), "there is no narrower one"


def test_a_law_without_a_plainer_one_leaves():
    of = design(0, groups=8, rows=30)
    X = np.random.default_rng(50).standard_normal((*of.y.shape, 2))
    of.y = of.y + X @ [1.0, 1.0]
    one = search(of, (law("first"), law("other")), X)
    assert with_plainer_law(one, one.score((0, 1)), 1).chosen == (0,)
