"""Rivals and their classes, and motions that would tell them apart: the algebra by hand."""

from dataclasses import dataclass
from math import erf, sqrt
from types import SimpleNamespace

import numpy as np
import pytest
from races import JOINTS, NOISE, SINGLE, K, P, Plain, candidate, fit, instance, race, raced, rows, tables

from nnhydro.diagnosis.contest import Contest, Judge, contest_of, least_pair
from nnhydro.diagnosis.uncertainty import likeness
from nnhydro.diagnosis.verdict import Rival, parameter_count, rivals_of, simplest

PRIOR = np.array([4.0, 0.0, 50.0])


def rival(behind, p=0.0, alike=0.0, gain=100.0, general=False, special=False, wider=False):
    return Rival(behind, p, alike, gain, general, SINGLE[0], special, wider)


@pytest.mark.parametrize(("one", "inside"), [
    (rival(1.9), True), (rival(2.1), False),  # hardly behind, whatever the signs say
    (rival(9.9, p=0.06), True), (rival(9.9, p=0.04), False), (rival(10.1, p=1.0), False),  # behind, but not on the single recordings
    (rival(9.9, alike=0.975), True), (rival(10.1, alike=0.975), False), (rival(9.9, alike=0.965), False),  # much the same torque
    (rival(15.0, alike=0.975, gain=305.0), True), (rival(15.0, alike=0.975, gain=295.0), False),  # within a twentieth of the whole
    (rival(15.0, alike=0.975, gain=305.0, wider=True), False), (rival(9.9, alike=0.975, gain=305.0, wider=True), True),  # free, yet worse
    (rival(19.0, alike=0.91, general=True), True), (rival(21.0, alike=0.91, general=True), False),
    (rival(19.0, alike=0.89, general=True), False), (rival(19.0, alike=0.91), False), (rival(-5.0), True),
    (rival(44.0, alike=0.985, gain=300.0, special=True), True), (rival(46.0, alike=0.985, gain=300.0, special=True), False),
    (rival(44.0, alike=0.985, gain=300.0), False), (rival(44.0, alike=0.975, gain=300.0, special=True), False),  # the general form holds it
])
def test_a_rival_is_in_the_class_where_it_cannot_be_told_from_the_finding(one, inside):
    assert one.in_class == inside


@pytest.mark.parametrize(("one", "stands"), [
    (rival(9.9, alike=0.985), True), (rival(10.1, alike=0.985), False), (rival(9.9, alike=0.975), False),
    (rival(15.0, alike=0.985, gain=760.0), True), (rival(15.0, alike=0.985, gain=740.0), False),  # a fiftieth: less than the class allows
    (rival(19.0, alike=0.985, general=True), True), (rival(21.0, alike=0.985, general=True), False), (rival(1.0), False),
])
def test_a_rival_stands_for_the_finding_only_where_the_two_are_one_torque(one, stands):
    assert one.same_torque == stands


def effects(*families):
    return [SimpleNamespace(family=family, general=general) for family, general in families]


def competing(seed=1):
    """Column 1 is nearly column 0, which is planted; column 2 a quarter of it."""
    made = tables(seed, {0: 0.6, 4: 0.3})
    for table in made:
        table[..., P + 1] = table[..., P] + 0.1 * table[..., P + 1]
        table[..., P + 2] = table[..., P] + 4 * table[..., P + 2]
    kinds = effects(("a", False), ("a", True), ("b", True), ("a", False), ("a", False), ("a", False))
    bank = tuple(candidate(f"effect_{k}", (k,), effect=kind) for k, kind in enumerate(kinds))
    return made, bank


def test_rivals_take_the_findings_place_beside_the_others_and_the_best_come_first():
    made, bank = competing()
    found = race(made, bank, chosen=(0, 4))
    told = rivals_of(found, bank[0])
    assert [one.candidate.key[0] for one in told[:2]] == ["effect_1", "effect_2"]
    assert "effect_0" not in [one.candidate.key[0] for one in told]
    assert "effect_4" not in [one.candidate.key[0] for one in told], "it is chosen already"
    assert [one.general for one in told[:2]] == [True, False], "the general form of another family is none of its own"
    for one in told:
        assert one.behind == pytest.approx(found.total([one.candidate], [bank[0]]) - found.total())
        assert one.gain == pytest.approx(found.total(without=[bank[0]]) - found.total())
        assert one.likeness == pytest.approx(likeness(found, bank[0], one.candidate))
    assert told[0].p > 0.001
    assert told[1].p == pytest.approx(1 / 2**7)
    shaped = (*bank[:2], candidate("effect_2", (2,), effect=bank[2].instance.effect, spans={"v": (1.0, 2.0)}), *bank[3:])
    assert [one.wider for one in rivals_of(race(made, shaped, chosen=(0, 4)), bank[0])[:2]] == [False, True]


def test_no_more_than_five_rivals_are_told():
    made = tables(2, {0: 0.6}, columns=9)
    bank = tuple(candidate(f"effect_{k}", (k,), effect=SimpleNamespace(family="a", general=False)) for k in range(9))
    assert len(rivals_of(race(made, bank, chosen=(0,)), bank[0])) == 5


def test_a_name_with_fewer_parameters_stands_for_the_same_torque():
    made = tables(3, {0: 0.6})
    for table in made:
        table[..., P + 1] = table[..., P] + 0.01 * table[..., P + 1]
        table[..., P + 3] = table[..., P] + 2 * table[..., P + 3]
    plain, other = effects(("a", False), ("b", False))
    rich = candidate("rich", (1, 2), effect=plain)
    few, unlike = candidate("few", (0,), effect=other), candidate("unlike", (3,), effect=other)
    found = race(made, (rich, few, unlike), chosen=(0,))
    assert simplest(found) == [few]
    shaped = candidate("few", (0,), effect=other, spans={"v": (1.0, 2.0)})
    own = candidate("own", (0,), (1, 2))
    assert [parameter_count(one) for one in (rich, few, shaped, own)] == [2, 1, 2, 3]
    alone = race(made, (rich, unlike), chosen=(0,))
    assert simplest(alone) == [rich]


def contest(made, bank, members, rest=(), behind=(0.0, 0.0), limit=10.0, prior=0.0):
    found = race(made, bank, prior=prior, chosen=(*rest, members[0]))
    told = Contest(tuple(bank[k] for k in members), tuple(bank[k] for k in rest), behind, limit)
    return found, Judge(None, found, None, told)


@pytest.mark.parametrize("prior", [0.0, PRIOR])
def test_members_are_apart_by_what_the_other_and_the_refit_leave_of_ones_torque(prior):
    made, bank = competing()
    _, judge = contest(made, bank, (0, 1, 2), rest=(4,), prior=prior)
    r, H = rows(made), judge.recorded()
    order = [*range(P), *(P + k for k in (4, 0, 1, 2))]
    np.testing.assert_allclose(H, r.Z[:, order].T @ r.Z[:, order], rtol=1e-9)
    apart = judge.apart(H)
    for a, A in enumerate((0, 1, 2)):
        beta = fit(r.Z[:, [0, 1, 2, P + A, P + 4]], r.y, prior)[P]
        torque = beta * r.Z[:, P + A]
        for b, B in enumerate((0, 1, 2)):
            if a != b:
                Z = r.Z[:, [0, 1, 2, P + 4, P + B]]
                theta = fit(Z, torque, prior)
                left = ((torque - Z @ theta) ** 2).sum() + (np.broadcast_to(prior, P) * theta[:P] ** 2).sum()
                assert apart[a, b] == pytest.approx(left, rel=1e-4)
    assert (np.diag(apart) == 0).all()
    assert least_pair(apart) == pytest.approx(min(apart[a, b] for a in range(3) for b in range(3) if a != b))


@pytest.mark.parametrize("prior", [0.0, PRIOR])
def test_what_a_member_gains_where_it_is_the_truth_is_the_score_that_its_torque_takes_away(prior):
    made, bank = competing()
    _, judge = contest(made, bank, (0, 1, 2), rest=(4,), prior=prior)
    r, n = rows(made), 900.0
    told = judge.gained(judge.recorded(), n)
    for a, A in enumerate((0, 1, 2)):
        torque = fit(r.Z[:, [0, 1, 2, P + A, P + 4]], r.y, prior)[P] * r.Z[:, P + A]
        Z = r.Z[:, [0, 1, 2, P + 4]]
        theta = fit(Z, torque, prior)
        left = ((torque - Z @ theta) ** 2).sum() + (np.broadcast_to(prior, P) * theta[:P] ** 2).sum()
        assert told[a] == pytest.approx(n / 2 * np.log(1 + left / n), rel=1e-4)


def test_twice_the_recordings_tell_members_twice_as_far_apart():
    made, bank = competing()
    _, judge = contest(made, bank, (0, 1))
    H = judge.recorded()
    np.testing.assert_allclose(judge.apart(2 * H), 2 * judge.apart(H), rtol=1e-6)


def test_the_chance_is_that_of_the_members_that_fall_behind_by_the_limit():
    gain, rows_ = np.array([[0.0, 30.0, 50.0], [40.0, 0.0, 60.0], [20.0, 35.0, 0.0]]), 500.0
    behind, limit = (0.0, 3.0, 6.0), 10.0
    judge = Judge(None, None, None, Contest(("a", "b", "c"), (), behind, limit))
    weights, total = np.exp(-np.array(behind) / 6), 0.0
    for a in range(3):
        chances = []
        for b in range(3):
            if a != b:
                ahead = behind[b] - behind[a] + rows_ / 2 * np.log(1 + gain[a, b] / rows_) - limit
                chances.append((1 + erf(ahead / sqrt(2 * 1.5 * gain[a, b]))) / 2)
        total += weights[a] / weights.sum() * min(chances)
    assert judge.chance(gain, rows_) == pytest.approx(total, rel=1e-9)
    assert least_pair(gain) == 20.0


def test_a_contest_is_that_of_the_first_finding_that_has_rivals_in_its_class():
    made, bank = competing()
    found = race(made, bank, chosen=(4, 0))
    told = contest_of(found)
    inside = [one for one in rivals_of(found, bank[0]) if one.in_class]
    assert told.members == (bank[0], *(one.candidate for one in inside))
    assert told.rest == (bank[4],)
    assert told.behind == (0.0, *(one.behind for one in inside))
    further = [c.instance.effect.general and c.instance.effect.family == "a" for c in told.members]  # the general form of the family
    np.testing.assert_array_equal(told.limit, np.tile(np.where(further, 20.0, 10.0), (len(told.members), 1)))
    assert any(further)
    assert told.hardly.all(), "each has one column"
    assert bank[1] in told.members
    clear = race(tables(4, {0: 0.8}), tuple(candidate(f"e{k}", (k,), effect=SimpleNamespace(family="a", general=False)) for k in range(K)),
                 chosen=(0,))
    assert contest_of(clear) is None


def test_a_member_is_fitted_in_the_contest_by_its_widest_law_and_has_the_torque_of_the_nearest():
    """Which law of an effect comes nearest after the motion nobody knows: the widest holds all. What it does is what was seen of it."""
    made, bank = competing()
    member, effect = bank[1], bank[1].instance.effect
    laws = [candidate("effect_1", columns, effect=effect, spell=spell)
            for columns, spell in (((1, 5), None), ((1, 3, 5), None), ((1, 2, 3, 5), "run_1"))]
    wide = race(made, (*bank, *laws), chosen=(4, 0))
    told = contest_of(wide)
    place = told.members.index(member)
    assert told.freest[place] is laws[1], "of three columns; the law of four acts elsewhere"
    assert told.freest[0] is told.members[0] is bank[0]
    assert told.hardly.all(), "the nearest law may be the one of a single column"
    judge, r = Judge(None, wide, None, told), rows(made)
    assert judge.candidates == (*told.rest, *told.members, *told.freest[place:place + 1])
    apart = judge.apart(judge.recorded())
    torque = fit(r.Z[:, [0, 1, 2, P, P + 4]], r.y, 0.0)[P] * r.Z[:, P]
    Z = r.Z[:, [0, 1, 2, P + 4, P + 1, P + 3, P + 5]]
    assert apart[0, place] == pytest.approx(((torque - Z @ fit(Z, torque, 0.0)) ** 2).sum(), rel=1e-4)
    torque = fit(r.Z[:, [0, 1, 2, P + 1, P + 4]], r.y, 0.0)[P] * r.Z[:, P + 1]
    Z = r.Z[:, [0, 1, 2, P + 4, P]]
    assert apart[place, 0] == pytest.approx(((torque - Z @ fit(Z, torque, 0.0)) ** 2).sum(), rel=1e-4)


@pytest.mark.parametrize(("near", "wide", "possible"), [(True, False, 1.0), (False, True, 1.0), (False, False, 0.0)])
def test_a_rival_is_possible_where_one_of_its_laws_makes_sense(near, wide, possible):
    made, bank = competing()
    free = ((-np.inf, np.inf),)
    laws = [candidate("effect_1", columns, effect=bank[1].instance.effect, plausible=lambda values, sense=sense: sense,
                      bounds=lambda columns=columns: free * len(columns)) for columns, sense in (((1,), near), ((1, 3), wide))]
    one = candidate("effect_0", (0,), effect=bank[0].instance.effect, bounds=lambda: free)
    found = race(made, (one, *laws), chosen=(0,))
    judge = Judge(None, found, None, Contest((one, laws[0]), (), (0.0, 5.0), 10.0, freest=(one, laws[1])))
    assert judge.possible(judge.recorded())[0, 1] == possible


def test_a_rival_is_as_free_as_the_narrowest_law_of_its_effect():
    made, bank = competing()
    effect = bank[1].instance.effect
    rich = [candidate("effect_1", columns, effect=effect) for columns in ((1, 5), (1, 3, 5))]
    free = race(made, (bank[0], bank[4], *rich), chosen=(1, 0))
    assert [one.wider for one in rivals_of(free, bank[0]) if one.candidate.key[0] == "effect_1"] == [True]
    np.testing.assert_array_equal(contest_of(free).hardly, [[True, False], [True, True]])
    plain = race(made, (bank[0], bank[4], bank[1], *rich), chosen=(1, 0))
    assert [one.wider for one in rivals_of(plain, bank[0]) if one.candidate.key[0] == "effect_1"] == [False], "whichever law comes nearest"


def test_noise_is_held_against_each_joint_of_its_own():
    made, bank = competing()
    _, judge = contest(made, bank, (0, 1))
    louder = race([np.concatenate([t[:, :1], 3 * t[:, 1:]], axis=1) for t in made], bank, noise=NOISE * [1.0, 3.0], chosen=(0,))
    np.testing.assert_allclose(Judge(None, louder, None, judge.contest).recorded(), judge.recorded(), rtol=1e-9)
    assert JOINTS == 2


def test_members_with_values_of_each_recordings_own_leave_as_recordings_cost_them_what_each_has_cost_so_far():
    behind, before, added = (4.0, 9.0), 6, 3
    told = Contest(("a", "b"), (), (0.0, 5.0), 10.0, behind)
    judge = Judge(None, SimpleNamespace(bench=SimpleNamespace(by_unit=(None, np.ones(before)))), None, told)
    truth = 1 / (1 + np.exp(-4.0 / 6) + np.exp(-9.0 / 6))
    later = [x * (before + added) / before for x in behind]
    leave = [(1 + erf((x - 10.0) / sqrt(4 * x))) / 2 for x in later]
    assert judge._own_leave(added) == pytest.approx(truth * min(leave))
    gain = np.array([[0.0, 80.0], [80.0, 0.0]])
    alone = Judge(None, None, None, Contest(("a", "b"), (), (0.0, 5.0), 10.0))
    assert alone._own_leave(added) == 1.0
    assert judge.chance(gain, 500.0, recordings=added) == pytest.approx(alone.chance(gain, 500.0) * truth * min(leave))


@dataclass(frozen=True)
class NoCase:
    """What planning asks of a case."""

    all_units: object = None
    places: object = None


def test_motions_that_nobody_has_recorded_count_with_their_rows_of_all_joints_less_what_constants_explain(monkeypatch):
    later = tables(5, units=2)
    known = [instance(f"e{k}", (k,)) for k in (0, 1)]
    found = raced(Plain(tables(4)), known, chosen=(0,))
    monkeypatch.setattr("nnhydro.diagnosis.contest.unit_of", lambda *given: None)
    monkeypatch.setattr("nnhydro.diagnosis.contest.Table", lambda case: Plain(later))
    judge = Judge(NoCase(), found, None, Contest(tuple(found.bank.candidates), (), (0.0, 5.0), 10.0))
    told = judge.planned(["one", "two"])
    assert [one.motion for one in told] == ["one", "two"]
    for one, table in zip(told, later, strict=True):
        assert one.rows == 2 * len(table)
        X = (table[..., [*range(P), P, P + 1]] - table[..., [*range(P), P, P + 1]].mean(axis=0)) / NOISE[:, None]
        np.testing.assert_allclose(one.G, np.einsum("njp,njq->pq", X, X), rtol=1e-6, atol=1e-6)
