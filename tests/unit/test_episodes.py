"""Effects that act in some recordings of a campaign: the algebra by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from races import SINGLE, K, P, candidate, fit, instance, race, raced, rows, tables
from races import Plain as Table
from rigs import arm

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.episodes import Small, _spells, by_turns, in_a_row
from nnhydro.diagnosis.spell import Sector, Spell
from nnhydro.diagnosis.spells import Order, _turning, judged, spelled
from nnhydro.effects.catalogue import effect_of_id

PRIOR = np.array([4.0, 0.0, 50.0])
OTHER = [SINGLE[4]]


def acting(acts, seed=5, units=12, value=0.8):
    """Column 1 acts in the recordings `acts`, column 4 in all."""
    made = tables(seed, {4: 0.3}, units=units, rows=(60, 80))
    for k, table in enumerate(made):
        table[..., -1] += (value if acts(k) else 0.0) * table[..., P + 1]
    return made


def every(count):
    return range(1, count)


def test_spells_begin_or_end_between_recordings_and_leave_four_inside_and_two_outside():
    found = [tuple(np.flatnonzero(inside).tolist()) for _, inside in _spells(list(range(8)), 8, every(8))]
    assert set(found) == {tuple(range(k)) for k in (4, 5, 6)} | {tuple(range(k, 8)) for k in (2, 3, 4)}
    assert len(found) == 6
    assert list(_spells(list(range(5)), 5, every(5))) == []
    mixed = [tuple(np.flatnonzero(inside).tolist()) for _, inside in _spells([5, 0, 3, 1, 7, 2], 8, every(6))]
    assert set(mixed) == {(0, 1, 3, 5), (1, 2, 3, 7)}


@pytest.mark.parametrize("turn", [6, 7])
def test_the_best_spell_is_the_one_whose_columns_masked_by_hand_score_best(turn):
    made = acting(lambda k: k >= turn)
    total, inside = in_a_row(race(made, prior=PRIOR), SINGLE[1], OTHER, list(range(12)))
    np.testing.assert_array_equal(inside, np.arange(12) >= turn)
    masked = [table.copy() for table in made]
    for k, table in enumerate(masked):
        table[..., P + 1] *= float(k >= turn)
    assert total == pytest.approx(race(masked, prior=PRIOR).bench.scored(np.array([1, 4])).total + 2, rel=1e-9)


def test_in_a_long_campaign_the_turn_is_found_to_the_recording():
    made = acting(lambda k: k < 23, units=40)
    _, inside = in_a_row(race(made), SINGLE[1], OTHER, list(range(40)))
    np.testing.assert_array_equal(inside, np.arange(40) < 23)


def test_recordings_are_dealt_to_the_effect_that_acts_in_some():
    at = {0, 3, 4, 7, 10}
    made = acting(lambda k: k in at)
    found = race(made, prior=PRIOR)
    start = in_a_row(found, SINGLE[1], OTHER, list(range(12)))[1]
    total, inside = by_turns(found, SINGLE[1], OTHER, list(range(12)), start)
    assert set(np.flatnonzero(inside).tolist()) == at
    masked = [table.copy() for table in made]
    for k, table in enumerate(masked):
        table[..., P + 1] *= float(k in at)
    assert total == pytest.approx(race(masked, prior=PRIOR).bench.scored(np.array([1, 4])).total + 2, rel=1e-9)
    assert by_turns(race(acting(lambda k: True)), SINGLE[1], OTHER, list(range(12)), start) is None


def placed(made, order, steady=()):
    """A plain table whose recordings lie in that order in the campaign."""
    return Table(made, steady, {number: place for place, number in enumerate(order)})


def inside_and_outside(made):
    """What is judged of column 1 from the sixth recording on beside column 4, and the plain fit (Z, theta): columns 4 and 5 in, outside."""
    table = placed(made, range(12))
    found = raced(table, [instance(f"effect_{k}", (k,)) for k in range(K)], chosen=(4, 1))
    four, one = found.chosen
    told = judged(found, table, None, one, [four], Spell(begin=5.75, since="run6"), 1.0)
    r = rows(made, found.noise)
    inside = r.unit >= 6
    Z = np.column_stack([r.Z[:, [0, 1, 2, P + 4]], r.Z[:, P + 1] * inside, r.Z[:, P + 1] * ~inside])
    return told, Z, np.linalg.lstsq(Z, r.y, rcond=None)[0]


def test_what_it_does_outside_is_asked_by_a_column_of_its_own_there():
    made = acting(lambda k: k >= 6)
    for k, table in enumerate(made):
        table[..., -1] += (0.4 if k < 6 else 0.0) * table[..., P + 1]
    told, Z, theta = inside_and_outside(made)
    assert told.outside == pytest.approx(abs(theta[5] / theta[4]), rel=1e-3)
    assert not told.holds
    left = Z[:, 5] - Z[:, :5] @ np.linalg.lstsq(Z[:, :5], Z[:, 5], rcond=None)[0]
    assert told.visible == pytest.approx(theta[4] ** 2 * (left**2).sum(), rel=1e-2)
    assert told.beta == pytest.approx(theta[[4]], rel=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_however_little_it_does_outside_it_is_told_as_it_is(seed):
    made = tables(seed, {4: 0.3}, units=12, rows=(30, 40))
    for k, table in enumerate(made):
        table[..., -1] += (k >= 6) * table[..., P + 1]
    told, _, theta = inside_and_outside(made)
    assert told.outside == pytest.approx(abs(theta[5] / theta[4]), rel=0.02, abs=5e-4)


def test_what_it_does_outside_may_be_of_the_other_sign():
    """Held at 0 there, as a value that nobody could have, it would seem to act inside alone."""
    made = acting(lambda k: k >= 6)
    for k, table in enumerate(made):
        table[..., -1] += 0.3 * table[..., P + 2] - (0.4 if k < 6 else 0.0) * table[..., P + 1]
    table = Table(made, places=list(range(12)))
    pair = instance("pair", (1, 2), limits=((0.0, 10.0), (0.0, 10.0)))
    found = raced(table, [pair])
    told = judged(found, table, None, found.bank.candidates[0], [], Spell(begin=5.75, since="run6"), 1.0)
    assert told.outside > 0.4
    assert not told.holds


def test_units_that_have_no_place_are_in_no_spell_and_own_values_have_none():
    made = acting(lambda k: k >= 6)
    told = in_a_row(race(made), SINGLE[1], OTHER, [k for k in range(12) if k != 9])
    np.testing.assert_array_equal(np.flatnonzero(told[1]), [6, 7, 8, 10, 11])
    own = candidate("own", (), (2,))
    assert in_a_row(race(made, (SINGLE[1], own)), SINGLE[1], [own], list(range(12))) is None
    assert in_a_row(race(made), SINGLE[1], OTHER, list(range(5))) is None


def test_a_spell_with_a_value_beyond_its_bounds_is_none():
    made = acting(lambda k: k >= 6)
    assert in_a_row(race(made, low=0.0), SINGLE[1], OTHER, list(range(12))) is not None
    assert in_a_row(race(made, high=0.0), SINGLE[1], OTHER, list(range(12))) is None


def test_moving_recordings_are_put_in_the_order_of_the_campaign():
    table = placed(tables(6, units=4), [2, 0, 3, 1], steady=(3,))
    order = Order.of(table)
    assert (order.numbers, order.names) == ([2, 0, 1], ["run2", "run0", "run1"])
    np.testing.assert_allclose(order.places, [[0, 0.5], [1, 1.5], [3, 3.5]])
    table.pieces = table.pieces[1:]
    assert Order.of(table).numbers == [1, 0], "numbers are those of the units that hold rows"


def test_a_run_of_recordings_is_a_spell_with_its_place_and_any_others_are_told_by_name():
    order = Order.of(placed(tables(6, units=4), [2, 0, 3, 1]))
    assert order.spell(np.array([False, True, False, True])) == Spell(begin=1.75, since="run3")
    assert order.spell(np.array([True, False, True, False])) == Spell(end=1.75, until="run0")
    assert order.spell(np.array([True, True, False, False])) == Spell(inside=frozenset({"run0", "run1"}))


def test_the_spell_of_an_effect_is_found_with_its_first_and_last_recording_and_is_written_down():
    order = [3, 1, 0, 2, 5, 4, 11, 10, 9, 8, 7, 6]
    made = acting(lambda k: k in order[6:])
    known = [instance(f"effect_{k}", (k,)) for k in range(K)]
    for chosen in ((4, 1), (4,)):  # chosen already, or turned up by the running sums
        table = placed(made, order)
        found = raced(table, known, chosen=chosen)
        (one,) = spelled(found, table, None)
        assert one.key == ("effect_1", 0)
        assert one.spell == Spell(begin=5.75, since="run11")
        assert any(line.startswith("effect_1 joint 0: ") and "by acting from run11 on, 0.0" in line for line in found.log)


def test_an_effect_that_always_acts_has_no_spell_nor_has_a_short_campaign():
    known = [instance(f"effect_{k}", (k,)) for k in range(K)]
    table = placed(acting(lambda k: True), range(12))
    assert spelled(raced(table, known, chosen=(1, 4)), table, None) == []
    short = placed(acting(lambda k: k >= 3, units=5), range(5))
    assert spelled(raced(short, known, chosen=(4,)), short, None) == []


def test_turning_candidates_are_those_whose_running_sum_leaves_nothing_furthest():
    made = acting(lambda k: k >= 6, value=0.5)
    found = race(made, (*SINGLE, candidate("own", (), (2,))), chosen=(4,))
    told = _turning(found, list(range(12)))
    assert told[0] is SINGLE[1]
    assert SINGLE[4] not in told
    assert all(not c.own for c in told)
    many = race(tables(7, columns=12), tuple(candidate(f"e{k}", (k,)) for k in range(12)))
    assert len(_turning(many, list(range(7)))) == 8
    best = race(made, (candidate("same", (0,)), candidate("same", (1,))))
    assert [c.columns for c in _turning(best, list(range(12)))] == [(1,)]


def test_a_recording_is_dealt_to_an_effect_where_its_fitted_torque_takes_energy_away():
    made = acting(lambda k: k in {0, 3, 4, 7, 10}, value=0.4)
    start, r = np.arange(12) < 6, rows(made)
    told = Small(race(made, prior=PRIOR), SINGLE[1], OTHER).dealt(start)
    column = r.Z[:, P + 1] * start[r.unit]
    theta = fit(np.column_stack([r.Z[:, :P], column, r.Z[:, P + 4]]), r.y, PRIOR)
    left = r.y - r.Z[:, :P] @ theta[:P] - r.Z[:, P + 4] * theta[P + 1]
    gained = left**2 - (left - theta[P] * r.Z[:, P + 1]) ** 2
    np.testing.assert_array_equal(told, [gained[r.unit == u].sum() > 0 for u in range(12)])


def test_dealing_ends_where_nothing_changes(monkeypatch):
    at, dealt, real = {0, 3, 4, 7, 10}, [], Small.dealt
    monkeypatch.setattr(Small, "dealt", lambda small, inside: dealt.append(inside) or real(small, inside))
    made = acting(lambda k: k in at)
    _, inside = by_turns(race(made, prior=PRIOR), SINGLE[1], OTHER, list(range(12)), np.isin(np.arange(12), [*at]))
    assert set(np.flatnonzero(inside).tolist()) == at
    assert len(dealt) == 1


def test_a_spell_is_one_of_as_many_as_were_tried(monkeypatch):
    """Runs from or up to a recording, any recordings, rows of a moment, pairs of quantiles of each joint's angle."""
    from nnhydro.diagnosis import spells

    class Piece(SimpleNamespace):
        t = range(70)

    table, order = SimpleNamespace(pieces=[Piece()] * 12), Order(list(range(12)), [f"run{k}" for k in range(12)], np.zeros((12, 2)))
    monkeypatch.setattr(spells, "judged", lambda race, table, believed, c, others, spell, options: SimpleNamespace(
        candidate=c, others=(), spell=Spell(since="run3"), options=options, beta=np.ones(1)))
    halves, some = np.arange(12) >= 6, np.arange(12) % 2 == 0
    monkeypatch.setattr(spells, "in_a_row", lambda *given: (0.0, halves))
    monkeypatch.setattr(spells, "by_turns", lambda *given: (0.0, some))
    monkeypatch.setattr(spells, "moment", lambda *given: (99.0, 0.1, "run3", 1.5))
    monkeypatch.setattr(spells, "left_by", lambda *given: [])
    monkeypatch.setattr(spells, "projected", lambda *given: [])
    monkeypatch.setattr(spells, "race_of", lambda *given: SimpleNamespace(
        bank=SimpleNamespace(candidates=[one]), bench=SimpleNamespace(p=3, scored=lambda *kept: SimpleNamespace(theta=np.zeros(4)))))
    monkeypatch.setattr(spells, "sector", lambda *given: (99.0, 50.0, Sector(1, 0.0, 1.0)))
    effect = effect_of_id("viscous_friction").started(arm(2), joint=1)
    one = Candidate(instance("a", (0,), effect=effect), (0,))
    race = SimpleNamespace(total=lambda: 100.0, chosen=[], noise=np.ones(2), bank=SimpleNamespace(candidates=[one]))
    assert [told.options for told in spells._in_time(race, table, None, one, [], order)] == [2 * 12, 2 * 12 * 70, 2**12]
    assert [told.options for told in spells._in_space(race, table, None, [])] == [2 * 60**2 / 2]


def test_of_two_spells_of_an_effect_the_one_that_gains_more_beyond_its_price_goes_on(monkeypatch):
    from nnhydro.diagnosis import spells

    table = placed(acting(lambda k: k >= 6), range(12))
    found = raced(table, [instance(f"effect_{k}", (k,)) for k in range(K)], chosen=(4,))
    some, total = Spell(inside=frozenset({"run0"})), spells.quieter(found).total()

    def said(k, gain, options, spell, **changes):
        told = {"total": total - gain, "outside": 0.0, "visible": 99.0, "better": True} | changes
        return spells.Judged(found.bank.candidates[k], (), spell, options, beta=np.ones(1), **told)

    late = Spell(begin=0.5, since="run6")
    tried = [said(1, 200.0, 24.0, late), said(1, 210.0, 2.0**12, some),  # 6 log 2^12 is 31 more than 6 log 24
             said(0, 300.0, 24.0, some, outside=0.31), said(2, 300.0, 24.0, some, visible=9.9), said(3, 300.0, 24.0, some, better=False),
             said(5, 90.0, 24.0, late)]
    monkeypatch.setattr(spells, "_tried", lambda *given: tried)
    assert [(one.key[0], one.spell) for one in spelled(found, table, None)] == [("effect_1", late), ("effect_5", late)]
    tried[1] = said(1, 240.0, 2.0**12, some)
    assert [(one.key[0], one.spell) for one in spelled(found, table, None)] == [("effect_1", some), ("effect_5", late)]
    tried[-1] = said(5, 60.0, 24.0, late)  # 6 candidates x 24 spells x exp(-60 / 6) = 0.0065: seldom enough among what was tried
    assert [one.key[0] for one in spelled(found, table, None)] == ["effect_1", "effect_5"]
    tried[-1] = said(5, 50.0, 24.0, late)
    assert [one.key[0] for one in spelled(found, table, None)] == ["effect_1"]


@pytest.mark.parametrize(("known", "moment", "told"), [
    (Spell(begin=0.1, since="run2"), ("run2", 1.5), Spell(begin=0.2, since="run2", since_s=1.5)),
    (Spell(end=0.1, until="run1"), ("run2", 0.5), Spell(end=0.2, until="run2", until_s=0.5)),
])
def test_a_spell_with_a_moment_holds_the_recordings_beyond_it_throughout(monkeypatch, known, moment, told):
    from nnhydro.diagnosis import spells

    near = []
    table, order = placed(acting(lambda k: True, units=5), range(5)), Order(list(range(5)), [f"run{k}" for k in range(5)], np.zeros((5, 2)))
    monkeypatch.setattr(spells, "left_by", lambda *given: [])
    monkeypatch.setattr(spells, "moment", lambda rows, beta, recordings, begins: near.extend(recordings) or (99.0, 0.2, *moment))
    monkeypatch.setattr(spells, "judged", lambda *given: given[5])
    one = SimpleNamespace(candidate=Candidate(instance("e", (1,)), (0,)), others=(), spell=known, beta=np.ones(1))
    (spell,) = spells._sharper(SimpleNamespace(noise=np.array([0.5, 2.0])), table, None, one, order)
    assert spell == told
    assert near == ["run1", "run2"]
    assert spell.throughout == ({"run3", "run4"} if known.since else {"run0", "run1"})
