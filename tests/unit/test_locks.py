"""The two locks of a finding: block scores, the family-wise test, signs of left-out recordings, what is material."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from races import JOINTS, NOISE, SINGLE, K, P, candidate, fit, race, rows, tables

from nnhydro.diagnosis import locks
from nnhydro.diagnosis.locks import (
    TRIED,
    Extremes,
    block_scores,
    confirmed,
    family_wise_p,
    first_lock_p,
    gain_p,
    left_out_p,
    material,
    opens,
    passes,
    sign_flip_p,
    statistics,
    telling,
    turns,
)

PRIOR = np.array([4.0, 0.0, 50.0])


def projected(made, chosen, prior=0.0):
    """Residual (n,) of the fit of baseline and `chosen`, and every candidate column less what they explain of it (n, K)."""
    r = rows(made)
    Z = r.Z[:, [*range(P), *(P + k for k in chosen)]]
    theta = fit(Z, r.y, prior)
    B = np.stack([fit(Z, r.Z[:, P + k], prior) for k in range(K)], axis=1)
    return r, r.y - Z @ theta, r.Z[:, P:] - Z @ B


@pytest.mark.parametrize("chosen", [(), (0,), (0, 4)])
def test_block_scores_are_products_of_the_residual_with_what_the_choice_leaves_of_a_column(chosen):
    made = tables(1, {0: 0.4, 2: 0.2})
    U, energy = block_scores(race(made, prior=PRIOR, chosen=chosen))
    r, left, X = projected(made, chosen, PRIOR)
    want = np.stack([(X * left[:, None])[r.block == b].sum(axis=0) for b in range(int(r.block.max()) + 1)])
    free = [k for k in range(K) if k not in chosen]
    np.testing.assert_allclose(U[:, free], want[:, free], rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(U[:, list(chosen)], 0.0, atol=1e-3)
    np.testing.assert_allclose(energy[free], (X**2).sum(axis=0)[free] + (PRIOR * B_of(made, chosen) ** 2).sum(axis=1)[free], rtol=1e-5)
    assert (energy >= 0).all()


def test_beside_values_of_each_recordings_own_block_scores_are_those_off_their_columns():
    made = tables(1, {0: 0.4, 2: 0.2})
    bank = (SINGLE[0], candidate("own", (), (3,)), SINGLE[2], SINGLE[5])
    U, _ = block_scores(race(made, bank, prior=PRIOR, chosen=(0, 1)))
    r, left, X = projected(made, (0, 3), PRIOR)
    want = np.stack([(X * left[:, None])[r.block == b].sum(axis=0) for b in range(int(r.block.max()) + 1)])
    np.testing.assert_allclose(U[:, [2, 5]], want[:, [2, 5]], rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(U[:, [0, 3]], 0.0, atol=1e-3)


def B_of(made, chosen):
    """The baseline's share (K, P) of each column, which its prior holds."""
    r = rows(made)
    Z = r.Z[:, [*range(P), *(P + k for k in chosen)]]
    return np.stack([fit(Z, r.Z[:, P + k], PRIOR)[:P] for k in range(K)])


def test_the_statistic_is_the_larger_of_scores_and_signed_ranks_about_one_in_size():
    seen, null = statistics(race(tables(2)), 5)
    _, left, X = projected(tables(2), ())
    r = rows(tables(2))
    U = np.stack([(X * left[:, None])[r.block == b].sum(axis=0) for b in range(int(r.block.max()) + 1)])
    ranks = np.sign(U) * (np.argsort(np.argsort(np.abs(U), axis=0), axis=0) + 1)
    sizes = [np.abs(x.sum(axis=0)) / np.sqrt((x**2).sum(axis=0)) for x in (U, ranks)]
    np.testing.assert_allclose(seen, np.maximum(*sizes), rtol=1e-5)
    assert null.shape == (999, K)
    assert 0.9 < np.sqrt((null**2).mean()) < 1.25


def test_the_null_is_that_of_random_signs_of_the_blocks():
    found = race(tables(3))
    U, _ = block_scores(found)
    x = U / np.sqrt((U**2).sum(axis=0))
    ranks = np.sign(U) * (np.argsort(np.argsort(np.abs(U), axis=0), axis=0) + 1)
    y = ranks / np.sqrt((ranks**2).sum(axis=0))
    signs = np.random.default_rng(7).choice([-1.0, 1.0], size=(999, len(U)))
    np.testing.assert_allclose(statistics(found, 7)[1], np.maximum(np.abs(signs @ x), np.abs(signs @ y)), rtol=1e-9)


def test_a_column_that_the_baseline_holds_already_has_no_statistic():
    made = tables(4, {1: 0.5})
    for table in made:
        table[..., P + 2] = table[..., 0] - 2 * table[..., 1]
        table[..., P + 3] = 0.0
    seen, null = statistics(race(made), 0)
    assert (seen[[2, 3]] == 0).all()
    assert (null[:, [2, 3]] == 0).all()
    assert seen[1] > 4


def test_a_column_of_which_a_thousandth_is_left_still_has_a_voice():
    made = tables(4)
    for table in made:
        table[..., -1] += 3 * table[..., P + 2]
        table[..., P + 2] = table[..., 0] + 0.05 * table[..., P + 2]
    assert statistics(race(made), 0)[0][2] > 4


def test_values_of_a_recordings_own_do_not_enter_the_test():
    bank = (*SINGLE[:4], candidate("own", (), (4, 5)))
    seen, null = statistics(race(tables(5, {4: 0.5}), bank), 0)
    assert (seen[4:] == 0).all()
    assert (null[:, 4:] == 0).all()
    assert (seen[:4] > 0).all()


def test_the_family_pays_for_every_column_and_a_second_race_adds_to_it():
    quiet, loud = race(tables(6)), race(tables(7, {2: 0.15}))
    seen, null = statistics(quiet, 3)
    most = null.max(axis=1)
    assert Extremes().beside(quiet, 3).p_value == pytest.approx((1 + (most >= seen.max()).sum()) / 1000)
    both = Extremes().beside(quiet, 3).beside(loud, 3)
    one, many = statistics(loud, 3)
    assert both.seen == max(seen.max(), one.max())
    np.testing.assert_allclose(both.null, np.maximum(most, many.max(axis=1)))
    assert family_wise_p(loud, 3) == Extremes().beside(loud, 3).p_value


def test_where_nothing_was_tried_nothing_is_missing_and_no_p_is_below_a_thousandth():
    empty = race([table[..., [0, 1, 2, -1]] for table in tables(8)], ())
    assert Extremes().p_value == 1.0
    assert Extremes().beside(empty, 0).p_value == 1.0
    assert family_wise_p(race(tables(8, {1: 1.0})), 0) == pytest.approx(1 / 1000)


def test_one_violent_block_does_not_drown_what_all_others_say():
    made = tables(9, {1: 0.25}, units=8)
    plain = statistics(race(made), 0)[0][1]
    made[0][:20, :, -1] += 200 * made[0][:20, :, P + 1] * np.array([1.0, -1.0])
    assert statistics(race(made), 0)[0][1] > 0.5 * plain


@pytest.mark.parametrize(("gain", "tried", "p"), [(60.0, 100, 100 * np.exp(-10)), (0.0, 5, 1.0), (-20.0, 5, 1.0), (6.0, 1, np.exp(-1)),
                                                  (1e4, 100, 1e-3)])
def test_a_gain_with_values_of_its_own_has_a_p_by_markov_and_none_below_a_thousandth(gain, tried, p):
    assert gain_p(gain, tried) == pytest.approx(p)


@pytest.mark.parametrize("n", [4, 6, 9, 12])
def test_signs_up_to_twelve_are_all_tried(n):
    gains = np.random.default_rng(n).standard_normal(n) + 0.4
    cut = np.clip(gains, -3 * np.median(np.abs(gains)), 3 * np.median(np.abs(gains)))
    every = np.array(np.meshgrid(*[[-1, 1]] * n)).reshape(n, -1).T @ cut
    assert sign_flip_p(gains) == pytest.approx((every >= cut.sum() - 1e-9).mean())


def test_signs_of_many_recordings_are_drawn_the_observed_ones_among_them():
    gains = np.random.default_rng(1).standard_normal(40) * 0.1 + 1.0
    assert sign_flip_p(gains) == pytest.approx(1 / 4096)
    centred = np.random.default_rng(2).standard_normal(40)
    centred -= centred.mean()
    assert sign_flip_p(centred) == pytest.approx(0.5, abs=0.1)
    assert sign_flip_p(-gains) == pytest.approx(1.0, abs=1e-3)


def test_recordings_on_which_next_to_nothing_changes_do_not_vote():
    gains = np.array([1.0, 0.5, 0.019, -0.019, 0.021, -2.0])
    np.testing.assert_array_equal(telling(gains), [1.0, 0.5, -2.0])
    np.testing.assert_array_equal(telling(np.array([1.0, 0.021, -0.019])), [1.0, 0.021])
    np.testing.assert_array_equal(telling(np.array([1000.0, 2.1, -2.1, 1.9])), [1000.0, 2.1, -2.1])
    assert telling(np.zeros(5)).size == 0
    assert telling(np.full(5, 1e-10)).size == 0
    assert telling(np.array([])).size == 0


@pytest.mark.parametrize(("gains", "open_"), [
    ([1.0] * 4, True), ([1.0, 1.0, 1.0, -0.1], False), ([1.0] * 3, False), ([1.0] * 5, True), ([1.0, 1, 1, 1, -0.5], False),
    ([1.0] * 7 + [-0.2], True), ([1.0] * 4 + [0.001] * 6, True), ([1.0] * 4 + [-0.001] * 6, True), ([1.0] * 6 + [-1.0] * 3, False),
])
def test_the_second_lock_opens_at_one_in_twenty_or_where_all_of_four_agree(gains, open_):
    assert opens(np.array(gains)) == open_


def test_left_out_p_is_that_of_the_gain_a_recording():
    found = race(tables(10, {2: 0.4}))
    before, after = found.scored(), found.scored([SINGLE[2]])
    assert left_out_p(before, after) == pytest.approx(1 / 2**7)
    assert left_out_p(after, before) == 1.0


def test_the_material_share_is_the_largest_of_the_joints():
    found = race(tables(11))
    before = found.scored()
    energy = before.energy.copy()
    energy[:, 0] *= 0.9
    energy[:, 1] *= 1.2
    assert material(before, replace(before, energy=energy)) == pytest.approx(0.1)
    assert material(replace(before, energy=energy), before) == pytest.approx(1 - 1 / 1.2)


@pytest.mark.parametrize(("value", "said"), [(0.0, False), (0.5, True)])
def test_a_finding_passes_both_locks_and_is_written_down(value, said):
    found = race(tables(12, {2: value}))
    gain = found.total() - found.total([SINGLE[2]])
    assert passes(found, SINGLE[2], gain, 0) == said
    (line,) = found.log
    before, after = found.scored(), found.scored([SINGLE[2]])
    assert f"gain {gain:.1f}, p_block {family_wise_p(found, 0):.3f}, p_left_out {left_out_p(before, after):.4f}" in line
    assert f"energy {material(before, after):.3f}" in line


@pytest.mark.parametrize(("value", "said"), [(0.25, False), (0.35, True)])
def test_what_takes_away_less_than_a_hundredth_of_the_error_is_no_finding_however_sure(value, said):
    loud = tables(13, {2: value}, units=8, noise=np.array([3.0, 3.0]), rows=(900, 1000))
    found = race(loud, noise=np.array([3.0, 3.0]))
    before, after = found.scored(), found.scored([SINGLE[2]])
    assert family_wise_p(found, 0) <= 0.01
    assert left_out_p(before, after) <= 0.05
    assert 0.005 < material(before, after) < 0.02
    assert (material(before, after) >= 0.01) == said
    assert passes(found, SINGLE[2], 10.0, 0) == said


def test_the_first_lock_opens_to_the_signs_of_blocks_or_to_what_is_gained_on_data_left_out():
    enough = 6 * np.log(3 * TRIED / 0.01)
    assert first_lock_p(SINGLE[2], 40.0, 0.4) == pytest.approx(0.4)
    assert first_lock_p(SINGLE[2], enough, 0.4) == pytest.approx(0.01)
    assert first_lock_p(SINGLE[2], 0.0, 0.02) == pytest.approx(0.02)
    assert first_lock_p(candidate("own", (), (2,)), 0.0, 0.001) == 1.0, "no sign of a block speaks for a recording's own value"


def test_what_gains_enough_passes_where_the_signs_of_its_blocks_are_not_sure(monkeypatch):
    found = race(tables(12, {2: 0.5}))
    monkeypatch.setattr(locks, "family_wise_p", lambda race, seed: 0.015)
    assert not passes(found, SINGLE[2], 60.0, 0)
    assert passes(found, SINGLE[2], 80.0, 0)


def test_values_of_a_recordings_own_pass_the_first_lock_by_their_gain():
    rng, made = np.random.default_rng(5), tables(14)
    for table in made:
        table[..., -1] += 2.0 * rng.standard_normal() * table[..., P + 2]
    own = candidate("own", (), (2,))
    found = race(made, (own,))
    gain = found.total() - found.total([own])
    assert gain > 100
    assert passes(found, own, gain, 0)
    assert not passes(found, own, 6 * np.log(3 * TRIED / 0.0101), 0), "one in a hundred of three tests of all that are tried asks for more"
    assert passes(found, own, 6 * np.log(3 * TRIED / 0.0099), 0)


def test_recordings_in_which_nothing_is_missing_have_no_say_on_values_of_their_own():
    rng, made = np.random.default_rng(5), tables(14, units=9, noise=0.8 * NOISE)
    for u, table in enumerate(made[:3]):
        table[..., -1] += (3.0 - u) * np.sign(rng.standard_normal()) * NOISE * table[..., P + 2]
    own = candidate("own", (), (2,))
    found = race(made, (own,))
    before, after = found.scored(), found.scored([own])
    gains = before.by_unit - after.by_unit
    assert (gains[:3] > 20).all()
    assert (gains[3:] <= 0).all(), "there it only costs"
    assert passes(found, own, found.total() - found.total([own]), 0)
    assert not passes(race(tables(14, units=9, noise=0.8 * NOISE), (own,)), own, 100.0, 0)
    drift = candidate("drift", (3,), (2,))
    assert not passes(race(made, (drift,)), drift, 1000.0, 0), "what has common values, too, needs the votes of all"


def test_a_recording_as_quiet_as_noise_has_no_vote_on_a_wave_that_costs_it_something():
    rng, made = np.random.default_rng(5), tables(21, units=9, noise=0.84 * NOISE, rows=(40, 60))
    for u, table in enumerate(made[:4]):
        table[..., -1] += (4.0 - 0.5 * u) * np.sign(rng.standard_normal()) * NOISE * table[..., P + 2]
    wave = candidate("wave", (), (2,))
    found = race(made, (wave,))
    before, after = found.scored(), found.scored([wave])
    quiet = (before.energy <= 0.8 * found.bench.by_unit[1][:, None]).all(axis=1)
    costly = np.argmin(before.by_unit - after.by_unit)
    assert quiet[costly]
    assert not opens(before.by_unit - after.by_unit), "with its vote they would not agree"
    assert passes(found, wave, found.total() - found.total([wave]), 0)


def test_a_wave_that_all_recordings_show_a_little_passes_by_their_votes():
    gains = np.array([90.0, *[2.5] * 5, -0.5])
    assert not confirmed(gains)
    before, after = (SimpleNamespace(by_unit=by_unit, energy=1e9 * np.ones((7, 2))) for by_unit in (gains, 0 * gains))
    asked = SimpleNamespace(bench=SimpleNamespace(by_unit=(None, np.ones(7))))
    assert locks._agreed(asked, candidate("wave", (), (2,)), before, after)
    before.by_unit = np.array([90.0, 2.5, 2.5, -2.5, 2.5, -2.5, -0.5])
    assert not locks._agreed(asked, candidate("wave", (), (2,)), before, after)
    before.by_unit = np.array([90.0, 20.0, *[-0.5] * 5])
    assert not locks._agreed(asked, candidate("wave", (), (2,)), before, after), "small losses count in a likelihood"
    before.by_unit = np.array([90.0, 20.0, *[-0.4] * 5])
    assert locks._agreed(asked, candidate("wave", (), (2,)), before, after)


def test_a_street_that_few_of_many_recordings_show_passes_by_their_likelihoods():
    rng, made = np.random.default_rng(5), tables(14, units=9, noise=1.3 * NOISE)
    for u, table in enumerate(made[:3]):
        table[..., -1] += (3.0 - u) * np.sign(rng.standard_normal()) * NOISE * table[..., P + 2]
    street, drift = candidate("street", (), (2,)), candidate("drift", (3,), (2,))
    found = race(made, (street,))
    gains = found.scored().by_unit - found.scored([street]).by_unit
    assert not opens(gains), "the six that show nothing would outvote them"
    assert gains.sum() - gains.max() > 18
    assert passes(found, street, float(gains.sum()), 0)
    assert not passes(race(made, (drift,)), drift, 1000.0, 0), "what has common values, too, needs the votes of all"


@pytest.mark.parametrize(("gains", "said"), [((500.0, 18.1), True), ((500.0, 17.8), False), ((500.0,), False), ((), False),
                                             ((18.1, 500.0), True), ((400.0, 30.0, -13.0), False), ((400.0, 31.0, -13.0), True)])
def test_what_one_recording_shows_must_be_likely_in_the_others_too(gains, said):
    assert confirmed(np.array(gains)) == said  # 6 log 20 = 17.97


def test_the_noise_is_told_joint_by_joint():
    made = tables(15, {1: 0.4})
    for table in made:
        table[:, 1, -1] = table[:, 1, :P] @ np.array([1.0, -2.0, 0.5])  # joint 2 is fitted without error
    seen = statistics(race(made), 0)[0]
    swapped = [table[:, ::-1] for table in made]
    np.testing.assert_allclose(statistics(race(swapped, noise=NOISE[::-1]), 0)[0], seen, rtol=1e-9)
    assert JOINTS == 2


@pytest.mark.parametrize("unit", [1e-5, 1e3])
def test_nothing_depends_on_the_size_of_the_noise_unit_but_what_is_counted_in_it(unit):
    made = tables(16, {1: 0.3})
    plain, other = race(made), race(made, noise=unit * NOISE)
    for one, two in zip(statistics(plain, 2), statistics(other, 2), strict=True):
        np.testing.assert_allclose(two, one, rtol=1e-5, atol=1e-6)
    assert family_wise_p(other, 2) == family_wise_p(plain, 2)
    shares = [material(x.scored(), x.scored([SINGLE[1]])) for x in (plain, other)]
    assert shares[1] == pytest.approx(shares[0], rel=1e-6)


def test_a_column_turns_as_far_as_its_scores_of_the_first_or_the_last_recordings_leave_nothing():
    made = tables(1, {0: 0.4})
    for k, table in enumerate(made):
        table[..., -1] += (0.5 if k < 2 else -0.3) * table[..., P + 2]
    found, order = race(made), [4, 1, 6, 0, 3, 5]  # recording 2 has no place
    U, _ = block_scores(found)
    each = {u: U[found.bench.blocks.unit == u].sum(axis=0) for u in order}
    reach = [np.abs(sum(each[u] for u in part)) for k in range(1, len(order) + 1) for part in (order[:k], order[k:]) if part]
    np.testing.assert_allclose(turns(found, order), np.max(reach, axis=0) / np.sqrt((U**2).sum(axis=0)))
