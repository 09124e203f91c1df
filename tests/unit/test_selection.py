"""Choosing among hypotheses: the bank, swaps, the least gains, values tried alone first, what is told of it."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from races import JOINTS, NOISE, SINGLE, K, P, Plain, candidate, instance, race, raced, tables

from nnhydro.diagnosis import naming, tournament
from nnhydro.diagnosis.bank import build, listed
from nnhydro.diagnosis.blocks import parts_of
from nnhydro.diagnosis.locks import known_p, passes
from nnhydro.diagnosis.naming import _least, explained, torque_peaks
from nnhydro.diagnosis.race import ranked
from nnhydro.diagnosis.scout import scouted
from nnhydro.diagnosis.tournament import _improve, _merge, _next, _next_pair, run, run_again
from nnhydro.errors import CampaignError

PRIOR = np.array([4.0, 0.0, 50.0])
EACH = tuple(instance(f"effect_{k}", (k,)) for k in range(K))


def test_columns_lie_side_by_side_in_the_order_of_the_instances_those_of_a_recordings_own_apart():
    one, two, three = listed([instance("a", (0, 1)), instance("b", (2, 3, 4), own=(2,)), instance("c", (5,), own=(0,))])
    assert (one.columns, one.own) == ((0, 1), ())
    assert (two.columns, two.own) == ((2, 3), (4,))
    assert (three.columns, three.own) == ((), (5,))


def test_the_bank_holds_the_gram_sums_of_all_blocks_and_the_energy_of_the_torque():
    made = tables(1, rows=(20, 60))
    table = Plain(made, steady=(2,))
    bank, blocks = build(table, EACH[:2], None)
    lengths = [1 if k == 2 else len(parts_of(len(t), 4)) for k, t in enumerate(made)]
    np.testing.assert_array_equal(blocks.unit, np.repeat(np.arange(len(made)), lengths))
    assert blocks.p == P
    assert blocks.n.sum() == sum(len(t) for t in made)
    whole = sum(np.einsum("njp,njq->jpq", t[..., [0, 1, 2, 3, 4, -1]], t[..., [0, 1, 2, 3, 4, -1]]) for t in made)
    np.testing.assert_allclose(blocks.G.sum(axis=0), whole)
    np.testing.assert_allclose(bank.torque, sum((4 * t[..., -1] ** 2).sum(axis=0) for t in made))
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


def test_the_share_explained_is_the_gain_of_all_findings_over_the_excess_beyond_what_the_noise_is_known_to():
    made = tables(19, {0: 0.6, 4: 0.6})
    part, whole = race(made, chosen=(0,)), race(made).scored().total
    gain, rows_ = whole - part.scored().total, 2 * sum(len(table) for table in made)
    assert explained(part) == pytest.approx(gain / (whole - 0.05 * rows_ / 2))
    assert 0.2 < explained(part) < 0.8
    assert explained(race(made, chosen=(0, 4))) > 0.95
    quiet = race(tables(19, noise=0.5 * NOISE), chosen=(0,))
    whole, with_it = race(tables(19, noise=0.5 * NOISE)).scored().total, quiet.scored().total
    assert whole < 1
    assert explained(quiet) == pytest.approx(whole - with_it)


def proof_of(before, after, **without):
    return SimpleNamespace(before=before, after=after, without={(name, 0): e for name, e in without.items()})


def test_a_finding_goes_that_adds_little_on_left_out_recordings_and_in_the_score():
    found = race(tables(20, {0: 0.8, 4: 0.12}), chosen=(0, 4))
    scores = {k: found.total(without=[SINGLE[k]]) - found.total() for k in (0, 4)}
    whole = found.total(without=found.chosen) - found.total()
    assert scores[4] < 0.15 * whole < scores[0]
    assert _least(found, proof_of(0.5, 0.1, effect_0=0.45, effect_4=0.12)) is SINGLE[4]
    assert _least(found, proof_of(0.5, 0.1, effect_0=0.45, effect_4=0.126)) is None, "six hundredths of the improvement is enough"
    assert _least(found, proof_of(0.5, 0.1, effect_0=0.11, effect_4=0.2)) is None, "so is a sixth of the gain in score"
    even = race(tables(20, {0: 0.12, 4: 0.12, 2: 1.0}), chosen=(0, 4, 2))
    assert _least(even, proof_of(0.5, 0.1, effect_0=0.11, effect_4=0.105, effect_2=0.4)) is SINGLE[4], "the least of them"


def test_peaks_of_the_torque_are_those_of_rows_that_are_compared():
    keep = np.array([True, True, False])
    segments = [SimpleNamespace(tau=np.array([[1.0, -5.0], [-2.0, 3.0], [9.0, 9.0]]), keep=keep), SimpleNamespace(tau=None, keep=keep),
                SimpleNamespace(tau=np.full((3, 2), 99.0), keep=np.zeros(3, dtype=bool)),
                SimpleNamespace(tau=np.array([[0.5, 0.5], [-3.0, 0.1], [0.0, 0.0]]), keep=keep)]
    assert torque_peaks([SimpleNamespace(segments=lambda: segments[:2]), SimpleNamespace(segments=lambda: segments[2:])]) == (3.0, 5.0)


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


@pytest.mark.parametrize(("share", "said"), [(0.9, 0.8), (0.6, 0.8), (0.3, 0.4), (0.15, 0.2)])
def test_findings_that_explain_little_together_are_said_with_less_confidence(monkeypatch, share, said):
    @dataclass(frozen=True)
    class Said:
        confidence: float

    monkeypatch.setattr(naming, "findings", lambda race: [Said(0.8)])
    monkeypatch.setattr(naming, "more_to_see", lambda race, seed: True)
    monkeypatch.setattr(naming, "explained", lambda race: share)
    bank = (candidate("plain", (0,), effect=SimpleNamespace(foreseen=1.0)), candidate("gap", (1,), effect=SimpleNamespace(foreseen=0.4)))
    for planted, chosen, told in (({}, (0,), said), ({0: 0.8}, (0, 1), said), ({1: 0.8}, (0, 1), 0.8 * min(1.0, share / 0.24))):
        made = race(tables(1, planted), bank, chosen=chosen)  # of a gap nobody expects more
        assert [f.confidence for f in naming.trusted(made)] == pytest.approx([told])
    monkeypatch.setattr(naming, "more_to_see", lambda race, seed: False)  # what remains is nothing that anything could be the cause of
    assert [f.confidence for f in naming.trusted(made)] == pytest.approx([0.8])


@pytest.fixture
def naming_of(monkeypatch):
    """`named` over a race, in which only the findings' confidence and what a proof says are of the test's own making."""
    def told(found, confidence, gains):
        said = SimpleNamespace(race=found, table=None, believed=None)
        made = {"search": lambda *given: said, "instances": lambda *given: [], "torque_peaks": lambda units: (),
                "prune": lambda *given: None, "drop_made_by_filter": lambda *given: None,
                "simplest": lambda race: race.chosen, "explained": lambda race: 1.0,
                "findings": lambda race: [Told(confidence[c.key[0]], c) for c in race.chosen],
                "prove": lambda race, *given: proof_of(1.0, 0.1, **{c.key[0]: 0.1 + gains[c.key[0]] for c in race.chosen})}
        for name, value in made.items():
            monkeypatch.setattr(naming, name, value)
        case = SimpleNamespace(model=SimpleNamespace(arm=None), all_units=())
        return [f.candidate.key[0] for f in naming.named(case).findings]
    return told


@dataclass(frozen=True)
class Told:
    """What naming asks of a finding."""

    confidence: float
    candidate: object


FORESEEN = tuple(candidate(f"effect_{k}", (k,), effect=SimpleNamespace(foreseen=1.0)) for k in range(K))


def test_what_is_likelier_wrong_than_right_is_not_said(naming_of):
    made = race(tables(23, dict.fromkeys(range(4), 0.6)), FORESEEN, chosen=(0, 1, 2, 3))
    told = naming_of(made, dict(zip((f"effect_{k}" for k in range(4)), (0.9, 0.49, 0.5, 0.51), strict=True)),
                     {f"effect_{k}": 1.0 for k in range(4)})
    assert told == ["effect_0", "effect_2", "effect_3"]


def test_findings_that_add_too_little_go_one_by_one_and_the_last_stays(naming_of):
    made = tables(20, {0: 0.8, 4: 0.12, 3: 0.12})
    sure = {f"effect_{k}": 0.9 for k in range(K)}
    for gains, left in (((0.5, 0.01, 0.02), [0]), ((0.5, 0.2, 0.02), [0, 4]), ((0.5, 0.2, 0.2), [0, 4, 3])):
        told = naming_of(race(made, FORESEEN, chosen=(0, 4, 3)), sure, dict(zip(("effect_0", "effect_4", "effect_3"), gains, strict=True)))
        assert told == [f"effect_{k}" for k in left]
    alone = naming_of(race(tables(20, {4: 0.12}), FORESEEN, chosen=(4,)), sure, {"effect_4": 0.0})
    assert alone == ["effect_4"], "beside nothing else it need not add a share"


def test_there_is_more_to_see_where_an_effect_of_the_bank_still_gains_and_none_in_noise():
    assert naming.more_to_see(race(tables(31, {0: 0.6, 4: 0.4}), chosen=(0,)), 0)
    assert not naming.more_to_see(race(tables(31, {0: 0.6, 4: 0.4}), chosen=(0, 4)), 0)
    assert not naming.more_to_see(race(tables(32)), 0)


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


def test_masses_moved_far_beyond_what_is_known_of_them_testify_for_what_relieves_them():
    """A column that is baseline column 0 itself: recordings cannot tell it from the mass, only what is known of the mass can."""
    made = tables(35)
    for table in made:
        table[..., P] = 3.0 * table[..., 0]
        table[..., -1] += table[..., P] - 4.0 * table[..., 1]
    found = race(made, prior=np.array([8.0, 0.0, 0.0]))
    gain = found.total() - found.total([SINGLE[0]])
    assert known_p(found, found.scored()) < 1e-6
    assert found.scored().cost - found.scored([SINGLE[0]]).cost > 0.5 * gain
    assert passes(found, SINGLE[0], gain, 0)
    few = race(made[:3], prior=np.array([8.0, 0.0, 0.0]))
    assert known_p(few, few.scored()) == 1.0, "three recordings decide nothing"
    free = race(made, prior=1e-9)
    assert known_p(free, free.scored()) > 0.5
    assert not passes(free, SINGLE[0], gain, 0)
