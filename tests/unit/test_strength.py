"""How likely the locks open for an effect of a given strength: closed forms, limits, and the locks themselves on drawn scores."""

import numpy as np
import pytest
from races import NOISE, P, race, tables

from nnhydro.diagnosis.locks import TRIED, sign_flip_p
from nnhydro.diagnosis.strength import (
    Price,
    Where,
    _better_left_out,
    _gains,
    _ranked,
    _standardised_sum,
    chance,
    smallest_own_strength,
    smallest_strength,
)

PAID = Price(4.0, 1, 1.0)


def spread(units=12, blocks=4, strongest=0.7, rows=2000.0, correlation=1.0):
    """An effect that shows alike in every block."""
    n = units * blocks
    return Where(np.full(n, 1 / n), np.repeat(np.arange(units), blocks), strongest, rows, correlation)


def test_signed_ranks_count_from_one_and_a_score_of_nothing_has_none():
    np.testing.assert_array_equal(_ranked(np.array([[-0.1, 3.0, -2.0, 0.5]])), [[-1, 4, -3, 2]])
    np.testing.assert_array_equal(_ranked(np.array([[0.0, 3.0]])), [[0, 2]])


def test_a_standardised_sum_is_the_root_of_the_number_for_equal_scores_and_nothing_for_none():
    np.testing.assert_allclose(_standardised_sum(np.array([[2.0] * 9, [-1.0] * 9, [0.0] * 9])), [3.0, 3.0, 0.0])
    np.testing.assert_allclose(_standardised_sum(np.array([[3.0, -4.0]])), [0.2])


def test_the_gain_of_a_recording_is_what_the_value_that_the_others_taught_takes_away():
    where = spread(units=5, blocks=2)
    rng = np.random.default_rng(1)
    U = rng.standard_normal((3, 10))
    gains = _gains(U, where, 1)
    for draw in range(3):
        for u in range(5):
            mine = where.unit == u
            value = U[draw, ~mine].sum() / where.e[~mine].sum()
            assert gains[draw, u] == pytest.approx(value * U[draw, mine].sum() - value**2 / 2 * where.e[mine].sum())


def test_a_recording_that_shows_nearly_all_is_predicted_by_what_little_the_others_taught():
    e = np.array([0.97, 0.01, 0.01, 0.01])
    U = np.array([[9.0, 0.2, -0.1, 0.3]])
    gains = _gains(U, Where(e, np.arange(4), 1.0, 100.0), 1)[0]
    value = 0.4 / 0.03
    assert gains[0] == pytest.approx(value * 9.0 - value**2 / 2 * 0.97)
    value = 9.5 / 0.99
    assert gains[2] == pytest.approx(value * -0.1 - value**2 / 2 * 0.01)


def test_further_columns_cost_half_a_score_each_shared_by_the_recordings():
    for correlation in (1.0, 2.0):
        where, U = spread(units=5, blocks=2, correlation=correlation), np.ones((1, 10))
        np.testing.assert_allclose(_gains(U, where, 1) - _gains(U, where, 4), correlation * 3 / (2 * 4))


def test_a_recording_that_does_not_show_the_effect_has_no_gain():
    e = np.array([0.5, 0.25, 0.25, 0.0])
    gains = _gains(np.ones((2, 4)), Where(e, np.arange(4), 1.0, 100.0), 1)
    assert gains.shape == (2, 3)
    np.testing.assert_allclose(gains[0, 0], (2 / 0.5) * 1 - 0.5 * (2 / 0.5) ** 2 * 0.5 + 0 * e[0] + (3 / 0.5 - 2 / 0.5)
                               - 0.5 * ((3 / 0.5) ** 2 - (2 / 0.5) ** 2) * 0.5)


@pytest.mark.parametrize("n", [4, 6, 8])
def test_few_recordings_are_judged_by_all_signs_as_the_lock_does(n):
    gains = np.random.default_rng(n).standard_normal((60, n)) + 0.5
    np.testing.assert_array_equal(_better_left_out(gains), [sign_flip_p(g) <= 0.05 for g in gains])


def test_many_recordings_are_judged_as_if_normal_about_as_the_lock_does():
    gains = np.random.default_rng(3).standard_normal((200, 20)) + 0.37
    agree = _better_left_out(gains) == [sign_flip_p(g) <= 0.05 for g in gains]
    assert agree.mean() > 0.95
    assert 0.2 < _better_left_out(gains).mean() < 0.8
    most = np.clip(gains, *(3 * s * np.median(np.abs(gains), axis=1, keepdims=True) for s in (-1, 1)))
    np.testing.assert_array_equal(_better_left_out(gains), most.sum(axis=1) / np.sqrt((most**2).sum(axis=1)) >= 1.645)


def test_less_than_four_recordings_never_open_the_second_lock():
    assert not _better_left_out(np.ones((5, 3))).any()
    one_sided = np.concatenate([np.ones((5, 5)), -np.ones((5, 5))])
    np.testing.assert_array_equal(_better_left_out(one_sided), [True] * 5 + [False] * 5)


def test_no_effect_is_found_hardly_ever_and_a_strong_one_always():
    assert chance(0.0, spread(), PAID) == 0.0
    assert chance(100.0, spread(), PAID) == 1.0
    assert 0.02 < chance(4.5, spread(), PAID) < 0.98


def test_a_higher_threshold_a_dearer_effect_and_more_rows_each_lower_the_chance():
    plain = chance(5.5, spread(), PAID)
    assert chance(5.5, spread(), Price(5.0, 1, 1.0)) < plain
    assert chance(5.5, spread(), Price(4.0, 6, 1.0)) < plain
    assert chance(5.5, spread(), Price(4.0, 1, 25.0)) < plain
    assert chance(5.5, spread(rows=3000.0), PAID) < plain
    assert chance(5.5, spread(strongest=0.3), PAID) < plain


def test_of_a_strong_effect_the_gain_is_half_its_strength_squared_and_must_pay_the_price_and_be_material():
    strength = 30.0  # whole = lambda^2 / 2 about 450, scatter about 30
    assert chance(strength, spread(rows=1e3), Price(4.0, 1, 380.0)) > 0.9
    assert chance(strength, spread(rows=1e3), Price(4.0, 1, 520.0)) < 0.1
    share = 0.01  # 2 whole s / (rows + 2 whole s) >= 1 %
    rows = 2 * 450 * 0.7 * (1 - share) / share
    assert chance(strength, spread(rows=0.85 * rows), PAID) > 0.9
    assert chance(strength, spread(rows=1.15 * rows), PAID) < 0.1


def test_the_threshold_is_met_by_the_score_of_blocks_that_all_agree():
    where = spread(units=12, blocks=4)  # 48 blocks that agree: sum / root of squares = sqrt(48), of ranks sqrt(36.4)
    assert chance(1000.0, where, Price(6.9, 1, 1.0)) == 1.0
    assert chance(1000.0, where, Price(6.95, 1, 1.0)) == 0.0


def test_blocks_that_do_not_show_the_effect_do_not_vote():
    half = Where(np.repeat([1 / 24, 0.0], 24), np.repeat(np.arange(12), 4), 0.7, 2000.0)
    assert chance(1000.0, half, Price(4.89, 1, 1.0)) == 1.0  # sqrt(24)
    assert chance(1000.0, half, Price(4.91, 1, 1.0)) == 0.0


def test_the_smallest_strength_is_found_four_times_in_five_and_a_tenth_less_is_not():
    for where in (spread(), spread(units=6), spread(correlation=2.0)):
        least = smallest_strength(where, PAID)
        assert chance(least, where, PAID) >= 0.8
        assert chance(least / 1.02, where, PAID) < 0.8
    assert smallest_strength(spread(units=3), PAID) is None
    assert smallest_strength(spread(), Price(9.0, 1, 1.0)) is None, "48 blocks never reach 9"
    assert smallest_strength(spread(), Price(4.0, 1, 0.9 * 1e8 / 2)) == pytest.approx(1e4 * np.sqrt(0.9), rel=0.03)
    assert smallest_strength(spread(), Price(4.0, 1, 1.1 * 1e8 / 2)) is None, "none beyond 10,000 is tried"


def test_strength_grows_as_the_root_of_the_correlation_of_rows():
    one, four = (smallest_own_strength(spread(correlation=c), 0) for c in (1.0, 4.0))
    need = 6 * np.log(3 * TRIED / 0.01)
    assert one == pytest.approx(0.84 + np.sqrt(0.84**2 + 2 * need))
    assert four == pytest.approx(1.68 + np.sqrt(1.68**2 + 2 * need))


def gain_of(x, values, e, units):
    """The documented mean gain of `units` recordings of four blocks, of whose energy each block has the share `e`."""
    near = np.exp(-np.abs(np.arange(4)[:, None] - np.arange(4)) + 1.0) * (1 - np.eye(4))
    h = x**2 * e / values * near.sum(axis=1)
    return units * (x**2 * e / 2 * h / (1 + h)).sum()


@pytest.mark.parametrize(("values", "correlation"), [(1, 1.0), (2, 1.0), (2, 1.7)])
def test_values_of_each_recordings_own_ask_for_the_documented_strength(values, correlation):
    x = smallest_own_strength(spread(units=6, correlation=correlation), values)
    left = gain_of(x, values, 1 / 24, 6) - 0.84 * np.sqrt(correlation) * x
    assert left == pytest.approx(6 * np.log(3 * TRIED / 0.01))


def test_the_documented_gain_is_what_the_score_gains_by_values_of_each_recordings_own():
    rng, gained, x = np.random.default_rng(3), list[float](), 16.0
    for draw in range(40):
        made = tables(100 + draw, units=6, joints=1, rows=(400, 401))
        for table in made:
            wave = table[..., P:P + 2]
            wave /= np.sqrt((wave**2).sum(axis=(0, 1))) / NOISE[0]
            table[..., -1] += x / np.sqrt(12) * (wave @ rng.standard_normal(2))
        bench, none = race(made).bench, np.zeros(0, np.int64)
        gained.append(bench.scored(none).total - bench.scored(none, np.array([0, 1])).total)
    assert np.mean(gained) == pytest.approx(gain_of(x, 2, 1 / 24, 6), rel=0.15)


def test_values_of_their_own_must_be_seen_in_a_second_recording():
    assert smallest_own_strength(spread(units=1), 1) is None
    assert smallest_own_strength(spread(units=2), 1) is not None
    e = np.where(np.arange(24) < 4, 0.99 / 4, 0.01 / 20)
    x = smallest_own_strength(Where(e, np.repeat(np.arange(6), 4), 1.0, 100.0), 1)
    assert gain_of(x, 1, 0.01 / 20, 5) - 0.84 * x * 0.1 == pytest.approx(6 * np.log(20)), "the others must confirm what one recording shows"
    assert x > 2 * smallest_own_strength(spread(units=6), 1)
