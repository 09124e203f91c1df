"""A value that a fit would take below 0, its least one, is held there: the law stays, and so does what the others tell."""

import numpy as np
import pytest
from races import SINGLE, P, Plain, candidate, instance, race, raced, rows, tables
from scipy.optimize import nnls

from nnhydro.diagnosis import proof
from nnhydro.diagnosis.episodes import in_a_row
from nnhydro.diagnosis.locks import block_scores
from nnhydro.diagnosis.proof import prove, prove_fresh
from nnhydro.diagnosis.race import UNPHYSICAL, columns_of, gains, price, ranked
from nnhydro.diagnosis.tournament import _merge
from nnhydro.diagnosis.uncertainty import fitted

PAIR, OTHER = candidate("pair", (0, 1)), SINGLE[3]


def test_the_pair_is_scored_like_its_first_column_alone_where_the_second_would_be_negative():
    found = race(tables(3, {0: 0.6, 1: -0.1}), (PAIR, SINGLE[0]), low=0.0)
    assert found.total([PAIR]) - price([PAIR]) == pytest.approx(found.total([SINGLE[0]]) - price([SINGLE[0]]))
    baseline, values = found.values([PAIR])
    r = rows(tables(3, {0: 0.6, 1: -0.1}))
    alone = np.linalg.lstsq(r.Z[:, : P + 1], r.y, rcond=None)[0]
    assert values == pytest.approx({0: alone[P], 1: 0.0}, rel=1e-6)
    np.testing.assert_allclose(baseline, alone[:P], rtol=1e-6)


def test_a_value_above_zero_is_fitted_as_ever():
    found = race(tables(4, {0: 0.6, 1: 0.1}), (PAIR,), low=0.0)
    free = race(tables(4, {0: 0.6, 1: 0.1}), (PAIR,))
    assert found.total([PAIR]) == free.total([PAIR])
    assert found.held([PAIR]) == [PAIR]


@pytest.mark.parametrize(("planted", "low"), [({0: -0.6, 1: -0.1}, 0.0), ({0: 0.6, 1: -0.6}, -0.3)])
def test_what_has_no_value_left_or_another_bound_is_struck_out(planted, low):
    found = race(tables(5, planted), (PAIR,), low=low)
    assert found.total([PAIR]) == UNPHYSICAL


def test_a_single_value_below_zero_is_no_effect():
    found = race(tables(5, {0: -0.6}), SINGLE, low=0.0)
    assert found.total([SINGLE[0]]) == UNPHYSICAL
    assert gains(found, [SINGLE[0]])[0][0] < -UNPHYSICAL / 2


def test_holding_one_value_may_bring_another_below_zero():
    made = tables(6, {0: 1.0})
    for table in made:
        table[..., P + 2] = table[..., P + 1] + 0.1 * table[..., P + 2]  # nearly alike: one up, the other down
        table[..., -1] += 0.5 * table[..., P + 1] - 0.8 * table[..., P + 2]
    three = candidate("three", (0, 1, 2))
    found = race(made, (three, SINGLE[0]), low=0.0)
    assert found.held([three])[0].held == {1, 2}
    assert found.total([three]) - price([three]) == pytest.approx(found.total([SINGLE[0]]) - price([SINGLE[0]]))


def test_many_at_once_are_scored_as_one_by_one():
    found = race(tables(7, {0: 0.6, 1: -0.3, 3: 0.5}), (PAIR, *SINGLE), low=0.0, chosen=(4,))
    for gain, one in gains(found, [PAIR, SINGLE[0], SINGLE[2]]):
        assert gain == pytest.approx(found.total() - found.total([one]), rel=1e-9)
    best = {c.key: gain for gain, c in ranked(found, found.bank.candidates)}
    assert best[PAIR.key] == pytest.approx(found.total() - found.total([PAIR]))


def test_what_was_held_alone_is_fitted_beside_what_made_it_negative():
    made = tables(8, {0: 1.0, 1: 0.3, 3: -2.0})
    for table in made:
        table[..., P + 1] += 0.5 * table[..., P + 3]
    found = race(made, (PAIR, *SINGLE), chosen=(0,))
    found.bank.low[:2] = 0.0
    assert found.kept()[0].held == {1}
    assert [c.held for c in found.kept([OTHER])] == [set(), set()]
    assert found.chosen == [PAIR]


def test_a_rival_sets_free_what_was_held_without_it():
    made = tables(8, {0: 1.0, 1: 0.3, 3: -2.0})
    for table in made:
        table[..., P + 1] += 0.5 * table[..., P + 3]
    found = race(made, (PAIR, *SINGLE), chosen=(0,))
    found.bank.low[:2] = 0.0
    for gain, one in gains(found, [OTHER, SINGLE[5]]):
        assert gain == pytest.approx(found.total() - found.total([one]), rel=1e-9)


def test_of_two_values_that_a_fit_would_take_below_zero_one_may_be_above_it_alone():
    made = tables(15)
    for table in made:
        table[..., P + 1] = -0.9 * table[..., P] + 0.3 * table[..., P + 1]
        table[..., -1] += -1.0 * table[..., P] - 0.4 * table[..., P + 1]
    found = race(made, (PAIR, SINGLE[1]), low=0.0)
    assert found.held([PAIR])[0].held == {0}
    assert found.total([PAIR]) - price([PAIR]) == pytest.approx(found.total([SINGLE[1]]) - price([SINGLE[1]]))


@pytest.mark.parametrize("seed", [*range(8), 48, 80, 102])  # in the last three what was held first rises again beside what was held later
def test_what_is_held_is_what_least_squares_without_negative_values_puts_at_zero(seed):
    """Against scipy's nnls on the columns off what the baseline explains; columns that pull against each other."""
    rng, made, four = np.random.default_rng(seed), tables(seed, units=4), candidate("four", (0, 1, 2, 3))
    mixed, pull = rng.standard_normal((4, 4)), rng.standard_normal(4)
    for table in made:
        table[..., P:P + 4] = table[..., P:P + 4] @ mixed
        table[..., -1] += table[..., P:P + 4] @ pull
    r = rows(made)
    Z, y = (x - r.Z[:, :P] @ np.linalg.lstsq(r.Z[:, :P], x, rcond=None)[0] for x in (r.Z[:, P:P + 4], r.y))
    right = nnls(Z, y)[0]
    found = race(made, (four,), low=0.0)
    if right.any():
        assert [found.values([four])[1][k] for k in range(4)] == pytest.approx(right, abs=1e-3)
        assert found.held([four.holding({0, 1})])[0].held == found.held([four])[0].held
    else:
        assert found.total([four]) == UNPHYSICAL


def test_merged_choices_are_those_of_the_bank():
    """Two of three that share what one does alone make room for it; the third, of which a value is held, stays what it is."""
    made = tables(16, {0: 0.6, 1: -0.1})
    for table in made:
        table[..., P + 4] = table[..., P + 2] + table[..., P + 3] + 0.01 * table[..., P + 4]
        table[..., -1] += 0.8 * table[..., P + 4]
    found = race(made, (PAIR, *SINGLE[2:]), chosen=(0, 1, 2))
    found.bank.low[:2] = 0.0
    assert _merge(found, found.bank.candidates)
    assert found.chosen == [PAIR, SINGLE[4]]
    assert fitted(found).of(PAIR)[0][1] == 0.0


def test_what_is_seen_beside_a_held_value_is_what_is_seen_beside_the_others_alone():
    made = tables(17, {0: 0.6, 1: -0.1, 4: 0.2})
    pair, alone = (race(made, (*SINGLE, PAIR), low=0.0, chosen=(k,)) for k in (6, 0))
    for one, other in zip(block_scores(pair), block_scores(alone), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)


def test_a_part_of_a_campaign_is_sought_with_what_is_held_in_all_of_it():
    made = tables(18, {1: -0.1}, units=12)
    for table in made[6:]:
        table[..., -1] += 0.8 * table[..., P]
    pair, alone = (in_a_row(race(made, (*SINGLE, PAIR), low=0.0), one, [], list(range(12))) for one in (PAIR, SINGLE[0]))
    assert pair is not None
    assert alone is not None
    assert pair[1].tolist() == alone[1].tolist() == [False] * 6 + [True] * 6
    assert pair[0] - price([PAIR]) == pytest.approx(alone[0] - price([SINGLE[0]]), rel=1e-9)


def test_without_a_finding_the_others_are_held_as_they_are_without_it():
    made = tables(8, {0: 1.0, 1: 0.3, 3: -2.0}, units=9)
    for table in made:
        table[..., P + 1] += 0.5 * table[..., P + 3]
    both, alone = (raced(Plain(made), [instance("pair", (0, 1)), instance("other", (3,))][:k], chosen=range(k)) for k in (2, 1))
    for found in (both, alone):
        found.bank.low[:2] = 0.0
    told = prove(both, Plain(made), None)
    assert told.without[("other", 0)] == pytest.approx(prove(alone, Plain(made), None).after, rel=1e-9)
    assert told.after < 0.9 * told.without[("other", 0)]


def test_a_held_value_is_told_as_zero_with_the_width_of_the_fit():
    made = tables(9, {0: 0.6, 1: -0.02})
    found, free = race(made, (PAIR,), low=0.0, chosen=(0,)), race(made, (PAIR,), chosen=(0,))
    values, covariance = fitted(found).of(PAIR)
    assert values[1] == 0.0
    assert values[0] > 0.5
    np.testing.assert_allclose(np.diag(covariance), np.diag(fitted(free).of(PAIR)[1]), rtol=0.3)


def test_the_places_that_are_held_are_those_of_the_candidates_own_columns():
    one = candidate("one", (4, 2, 7))
    held = one.holding([1])
    assert held.free == (4, 7)
    assert columns_of([held, SINGLE[1]]).tolist() == [1, 4, 7]
    assert held.holding(()).free == one.columns
    assert one.holding(()) is one
    assert held.columns == one.columns


def held_and_alone(made):
    """Races over `made` with the pair, whose second value is held, and with its first column alone."""
    for one in (instance("pair", (0, 1)), instance("alone", (0,))):
        found = raced(Plain(made), [one], chosen=(0,))
        found.bank.low[:] = 0.0
        yield found


def test_left_out_recordings_are_predicted_with_the_value_at_zero():
    made = tables(10, {0: 0.6, 1: -0.4}, units=9)
    pair, alone = (prove(found, Plain(made), None).after for found in held_and_alone(made))
    assert pair == pytest.approx(alone, rel=1e-9)


def test_fresh_recordings_are_predicted_with_the_value_at_zero(monkeypatch):
    made = tables(11, {0: 0.6, 1: -0.4}, units=12)
    monkeypatch.setattr(proof, "Table", lambda case, foretold: case)
    fresh, seen = Plain(made[8:]), Plain(made[:8])
    pair, alone = (prove_fresh(found, None, [fresh], prove(found, seen, None)).after for found in held_and_alone(made[:8]))
    assert pair == pytest.approx(alone, rel=1e-9)
