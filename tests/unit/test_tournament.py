"""The tournament: swaps, merges, pairs that hide each other, the least gains, and what a search started anew keeps."""

from dataclasses import replace

import numpy as np
import pytest
from races import SINGLE, P, candidate, race, tables

from nnhydro.diagnosis import tournament
from nnhydro.diagnosis.race import Race, ranked
from nnhydro.diagnosis.tournament import _improve, _merge, _next, _next_pair, _promising, run, run_again


def test_a_wrong_first_choice_is_swapped_for_the_better_one_and_what_earns_nothing_is_dropped():
    made = tables(4, {2: 0.5})
    for table in made:
        table[..., P + 1] = table[..., P + 2] + 0.5 * table[..., P + 1]
    found = race(made, chosen=(1,))
    _improve(found, SINGLE)
    assert [c.key[0] for c in found.chosen] == ["effect_2"]
    both = race(made, chosen=(2, 5))
    _improve(both, SINGLE)
    assert [c.key[0] for c in both.chosen] == ["effect_2"]


def test_a_swap_must_gain_two():
    made = tables(4, {2: 0.5})
    for table in made:
        table[..., P + 1] = table[..., P + 2] + 0.02 * table[..., P + 1]  # as good as the same
    for chosen in (1, 2):
        found = race(made, chosen=(chosen,))
        other = race(made, chosen=(3 - chosen,))
        assert abs(found.total() - other.total()) < 2
        _improve(found, SINGLE)
        assert found.chosen == [SINGLE[chosen]]


def test_no_more_than_five_are_chosen():
    made = tables(5, dict.fromkeys(range(6), 0.6))
    assert len(run(race(made), 0).chosen) == 5


def test_the_best_that_fails_a_lock_makes_room_for_one_nearly_as_good():
    made = tables(6, units=8, rows=(100, 101))
    for k, table in enumerate(made):  # column 0 pays in three recordings alone, and much; column 1 in all
        table[..., -1] += (1.2 if k < 3 else 0.0) * table[..., P] + 0.5 * table[..., P + 1]
    found = race(made)
    ((gain, best),) = _next(found, 0)
    assert best.key[0] == "effect_1"
    assert gain == pytest.approx(found.total() - found.total([SINGLE[1]]))


@pytest.mark.parametrize(("value", "stands_in"), [(0.45, False), (0.85, True)])
def test_what_gains_less_than_three_tenths_of_a_best_that_fails_does_not_stand_in_for_it(value, stands_in, monkeypatch):
    monkeypatch.setattr("nnhydro.diagnosis.tournament.passes", lambda race, c, gain, seed: c.key[0] != "effect_0")
    found = race(tables(6, {0: 1.2, 1: value}, units=8))
    gains = {c.key[0]: gain for gain, c in ranked(found, found.bank.candidates)}
    assert (gains["effect_1"] > 0.3 * gains["effect_0"]) == stands_in
    assert gains["effect_1"] > 5
    assert bool(_next(found, 0)) == stands_in


def test_a_further_effect_gains_at_least_a_fiftieth_of_the_first():
    found = race(tables(7, {0: 0.4}))
    ((gain, _),) = _next(found, 0)
    found.first_gain = 50 * gain * 0.98
    assert _next(found, 0)
    found.first_gain = 50 * gain * 1.02
    assert not _next(found, 0)


def test_the_first_gain_is_remembered():
    found = race(tables(7, {0: 0.6, 3: 0.3}))
    gain = found.total() - found.total([SINGLE[0]])
    run(found, 0)
    assert found.first_gain == pytest.approx(gain)
    assert {c.key[0] for c in found.chosen} == {"effect_0", "effect_3"}


def test_a_choice_that_was_reached_once_is_not_lost_by_starting_over(monkeypatch):
    """Column 5 is the sum of 0 and 4: started from nothing it comes first, and a search that cannot merge or swap stays with it."""
    made = tables(33, {0: 0.6, 4: 0.6})
    before = race(made, chosen=(0, 4))
    monkeypatch.setattr(tournament, "run", lambda found, seed: found if found.chosen else replace(found, chosen=[SINGLE[2]]))
    assert [c.key for c in run_again(race(made), before, 0).chosen] == [c.key for c in before.chosen]
    monkeypatch.setattr(tournament, "run", lambda found, seed: found if found.chosen else replace(found, chosen=[SINGLE[0], SINGLE[4]]))
    assert run_again(race(made), race(made, chosen=(2,)), 0).chosen == [SINGLE[0], SINGLE[4]]


def test_two_effects_that_hide_each_other_are_found_together(monkeypatch):
    made = tables(36, {0: 0.7, 4: 0.7})
    monkeypatch.setattr(tournament, "passes", lambda found, c, gain, seed: len(found.chosen) == 1 and gain > 0)
    found = race(made)
    assert not _next(found, 0)
    pair = _next_pair(found, 0)
    assert {c.key[0] for _, c in pair} == {"effect_0", "effect_4"}
    assert sum(gain for gain, _ in pair) == pytest.approx(found.total() - race(made, chosen=(0, 4)).total())
    assert {c.key[0] for c in run(race(made), 0).chosen} == {"effect_0", "effect_4"}
    monkeypatch.setattr(tournament, "passes", lambda found, c, gain, seed: len(found.chosen) == 1 and c.key[0] == "effect_0")
    assert not _next_pair(race(made), 0), "each must pass beside the other"


def test_no_partner_is_sought_for_what_gains_next_to_nothing_and_none_beside_what_is_found(monkeypatch):
    monkeypatch.setattr(tournament, "passes", lambda found, c, gain, seed: True)
    assert not _next_pair(race(tables(37)), 0)
    assert not _next_pair(race(tables(5, dict.fromkeys(range(6), 0.6)), chosen=(0,)), 0)


def test_one_effect_takes_the_place_of_two_that_share_what_it_does():
    made = tables(34, {0: 0.8})
    rng = np.random.default_rng(34)
    for table in made:  # columns 3 and 4 hold a part of column 0 each
        table[..., P + 3] = table[..., P] + 0.7 * rng.standard_normal(table.shape[:2])
        table[..., P + 4] = table[..., P] + 0.7 * rng.standard_normal(table.shape[:2])
    found = race(made, [SINGLE[0], SINGLE[3], SINGLE[4]], chosen=(1, 2))
    assert _merge(found, found.bank.candidates)
    assert [c.key[0] for c in found.chosen] == ["effect_0"]
    assert not _merge(found, found.bank.candidates)


@pytest.mark.parametrize(("margin", "merged"), [(1.9, False), (2.1, True)])
def test_a_merge_must_gain_two_and_leaves_the_others_in_place(margin, merged, monkeypatch):
    found = race(tables(34, {0: 0.8, 1: 0.5}), chosen=(3, 1, 4))
    better = found.total(without=[SINGLE[3], SINGLE[4]]) - found.total() + margin  # of one candidate in the place of 3 and 4

    def said(asked, bank, pair):
        return [(better if SINGLE[1] not in pair else -100.0, SINGLE[0])]

    monkeypatch.setattr(tournament, "ranked", said)
    assert _merge(found, SINGLE) == merged
    assert found.chosen == ([SINGLE[1], SINGLE[0]] if merged else [SINGLE[3], SINGLE[1], SINGLE[4]])


def ends(monkeypatch, totals):
    """A tournament that stays where it is set, or goes to effect 2 from nothing; a choice's total is the one told."""
    monkeypatch.setattr(tournament, "run", lambda found, seed: found if found.chosen else replace(found, chosen=[SINGLE[2]]))
    monkeypatch.setattr(Race, "total", lambda found: totals[found.chosen[0].key[0]])


@pytest.mark.parametrize(("before", "kept"), [(97.9, True), (98.1, False), (102.0, False)])
def test_the_choice_of_before_stays_where_it_ends_better_by_more_than_two(before, kept, monkeypatch):
    ends(monkeypatch, {"effect_0": before, "effect_2": 100.0})
    last = race(tables(33), chosen=(0,))
    last.first_gain = 77.0
    told = run_again(race(tables(33)), last, 0)
    assert told.chosen == [SINGLE[0] if kept else SINGLE[2]]
    assert told.first_gain == (77.0 if kept else 0.0), "what the first one gained is what further ones are measured by"
    assert ("as before" in told.log) == kept


def test_of_several_values_the_one_that_the_last_round_put_first_takes_the_place_of_before(monkeypatch):
    ends(monkeypatch, {"effect_0": 0.0, "effect_2": 100.0})
    refined, rough = candidate("effect_0", (1,)), candidate("effect_0", (5,))
    assert run_again(race(tables(33), (refined, SINGLE[2], rough)), race(tables(33), chosen=(0,)), 0).chosen == [refined]


def test_a_choice_of_before_that_is_no_longer_on_the_list_is_not_gone_back_to(monkeypatch):
    ends(monkeypatch, {"effect_0": 0.0, "effect_2": 100.0})
    assert run_again(race(tables(33), SINGLE[2:]), race(tables(33), chosen=(0, 2)), 0).chosen == [SINGLE[2]]


def orders(monkeypatch, alone, beside):
    """A ranking of [(gain, number)] with nothing chosen, and of one partner {number: (gain, number)} beside each."""
    def said(found, bank):
        return [(gain, SINGLE[k]) for gain, k in (alone if not found.chosen else [beside[SINGLE.index(found.chosen[0])]])]

    monkeypatch.setattr(tournament, "ranked", said)
    monkeypatch.setattr(tournament, "passes", lambda found, c, gain, seed: True)
    return race(tables(38))


@pytest.mark.parametrize(("gain", "more", "tried"), [(20.1, 20.0, True), (19.9, 20.0, False), (100.0, 30.1, True), (100.0, 29.9, False)])
def test_partners_are_sought_from_a_gain_of_twenty_and_gain_three_tenths_of_it(gain, more, tried, monkeypatch):
    assert bool(_next_pair(orders(monkeypatch, [(gain, 0)], {0: (more, 1)}), 0)) == tried


def test_the_three_best_pairs_are_tried_the_best_first(monkeypatch):
    found = orders(monkeypatch, [(50.0, 0), (40.0, 1), (30.0, 2), (25.0, 3)], {0: (20.0, 4), 1: (60.0, 4), 2: (50.0, 5), 3: (90.0, 5)})
    assert _next_pair(found, 0) == [(25.0, SINGLE[3]), (90.0, SINGLE[5])]
    asked = []
    monkeypatch.setattr(tournament, "passes", lambda beside, c, gain, seed: asked.append(beside.chosen[-1]) or False)
    assert _next_pair(found, 0) == []
    assert asked == [SINGLE[3], SINGLE[1], SINGLE[2]]


def test_each_of_a_pair_is_asked_what_it_gains_beside_the_other(monkeypatch):
    made, asked = tables(36, {0: 0.7, 4: -0.7}), {}
    for table in made:  # each hides half of the other
        table[..., P + 4] += 0.8 * table[..., P]

    def told(beside, c, gain, seed):
        asked[beside.chosen[-1].key[0], c.key[0]] = gain
        return True

    monkeypatch.setattr(tournament, "passes", told)
    found = race(made)
    ((gain, one), (more, other)) = _next_pair(found, 0)
    assert asked == pytest.approx({(a.key[0], b.key[0]): found.total([a]) - found.total([a, b]) for a, b in ((one, other), (other, one))})
    assert (gain, more) == pytest.approx((found.total() - found.total([one]), asked[one.key[0], other.key[0]]))


@pytest.mark.parametrize("share", [0.29, 0.31])
def test_five_at_most_that_gain_three_tenths_of_the_best_stand_in_for_it(share, monkeypatch):
    found = orders(monkeypatch, [(100.0, 0), *((100 * share, k) for k in (1, 2, 3, 4, 5))], {})
    assert [c for _, c in _promising(found)] == list(SINGLE[:5] if share > 0.3 else SINGLE[:1])
