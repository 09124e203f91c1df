"""Choosing among hypotheses: the bank, its columns and blocks, and values that are tried alone first."""

from types import SimpleNamespace

import numpy as np
import pytest
from races import JOINTS, K, P, Plain, instance, raced, tables

from nnhydro.diagnosis.bank import build, listed
from nnhydro.diagnosis.blocks import parts_of
from nnhydro.diagnosis.scout import scouted
from nnhydro.errors import CampaignError

EACH = tuple(instance(f"effect_{k}", (k,)) for k in range(K))


def test_columns_lie_side_by_side_in_the_order_of_the_instances_those_of_a_recordings_own_apart():
    one, two, three = listed([instance("a", (0, 1)), instance("b", (2, 3, 4), own=(2,)), instance("c", (5,), own=(0,))])
    assert (one.columns, one.own) == ((0, 1), ())
    assert (two.columns, two.own) == ((2, 3), (4,))
    assert (three.columns, three.own) == ((), (5,))


def test_the_bank_holds_the_gram_sums_of_all_blocks_and_the_energy_of_the_torque_and_what_columns_share_with_it():
    made = tables(1, rows=(20, 60))
    table = Plain(made, steady=(2,))
    bank, blocks = build(table, EACH[:2], None)
    lengths = [1 if k == 2 else len(parts_of(len(t), 4)) for k, t in enumerate(made)]
    np.testing.assert_array_equal(blocks.unit, np.repeat(np.arange(len(made)), lengths))
    assert blocks.p == P
    assert blocks.n.sum() == sum(len(t) for t in made)
    whole = sum(np.einsum("njp,njq->jpq", t[..., [0, 1, 2, 3, 4, -1]], t[..., [0, 1, 2, 3, 4, -1]]) for t in made)
    np.testing.assert_allclose(blocks.G.sum(axis=0), whole)
    np.testing.assert_allclose(bank.torque, sum((4 * t[..., -1] ** 2).sum(axis=0) for t in made))  # measured: twice what is explained
    np.testing.assert_allclose(bank.met, sum(np.einsum("njk,nj->jk", t[..., P:P + 2], 2 * t[..., -1]) for t in made))
    first = made[0][: parts_of(len(made[0]), 4)[0].stop][..., [0, 1, 2, 3, 4, -1]]
    np.testing.assert_allclose(blocks.G[0], np.einsum("njp,njq->jpq", first, first))


def test_units_without_rows_leave_no_gap_in_the_numbers():
    table = Plain(tables(2, units=4))
    table.pieces = table.pieces[1:]
    assert sorted(set(build(table, EACH[:1], None)[1].unit.tolist())) == [0, 1, 2]


def test_bounds_stand_column_by_column_and_columns_beside_join_the_baseline():
    fussy = instance("fussy", (3, 4), limits=((0.0, 2.0), (-3.0, np.inf)))
    bank, blocks = build(Plain(tables(3)), (EACH[0], fussy), None, lambda piece: np.ones((*piece.y.shape, 2)))
    np.testing.assert_array_equal(bank.low, [-np.inf, 0.0, -3.0])
    np.testing.assert_array_equal(bank.high, [np.inf, 2.0, np.inf])
    assert (blocks.p, blocks.K) == (P + 2, 3)
    np.testing.assert_allclose(blocks.G[:, :, P, P], np.repeat(blocks.n[:, None], JOINTS, axis=1))


def test_where_no_rows_count_the_user_is_told_what_mends_it():
    table = Plain(tables(3))
    table.pieces = ()
    with pytest.raises(CampaignError, match=r"no recording holds enough independent rows to diagnose$"):
        build(table, EACH, None)
    table.case.model.preparation = SimpleNamespace(low_pass=SimpleNamespace(cutoff_hz=2.5))
    with pytest.raises(CampaignError, match=r"low-pass at 2.5 Hz: record longer runs, or give a higher --cutoff"):
        build(table, EACH, None)


def test_of_many_values_the_four_best_of_every_key_go_on_beside_what_is_chosen():
    made = tables(21, {0: 0.3, 1: 0.6, 2: 0.5})
    for table in made:
        table[..., P + 3] = table[..., P + 2] + 0.3 * table[..., P + 3]
    known = [instance("many", (k,), grid=60) for k in (0, 1, 2, 3, 4, 5)] + [instance("other", (k,), grid=20) for k in (4, 5)]
    found, seen = raced(table := Plain(made), [instance("first", (1,))], chosen=(0,)), []
    best = scouted(table, known, found, None, seen.append)
    gains = {k: found.bench.scored(np.array([0])).total for k in range(6)}
    for k in gains:
        joined = raced(table, [instance("first", (1,)), instance("many", (k,), grid=60)], chosen=(0,))
        gains[k] = joined.total() - joined.total([joined.bank.candidates[1]])
    order = sorted((k for k in gains if k != 1), key=lambda k: -gains[k])
    assert [one.of[0] for one in best if one.key[0] == "many"][:2] == order[:2]
    assert sum(one.key[0] == "many" for one in best) == 4
    assert {one.of for one in best if one.key[0] == "other"} == {(4,), (5,)}
    assert len(seen) == 1
    assert table.computed == [(k, len(known)) for k in range(len(made))]


def test_many_values_are_tried_a_few_at_a_time_and_impossible_ones_do_not_go_on():
    table, seen = Plain(tables(22, {0: 0.5})), []
    known = [instance(f"many{k}", (k % K,), grid=60) for k in range(50)]
    known[0].limits = ((2.0, 3.0),)
    best = scouted(table, known, raced(table, [EACH[5]]), None, seen.append)
    assert [len(tried.bank.candidates) for tried in seen] == [24, 24, 2]
    assert {one.key[0] for one in best} == {f"many{k}" for k in range(1, 50)}
