"""Left-out scores, batches, prices and the noise: the algebra on Gram matrices gives what plain least squares on the rows gives."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from races import JOINTS, NOISE, SINGLE, TRUTH, K, P, blocks_of, candidate, fit, race, rows, tables
from scipy.stats import multivariate_normal

from nnhydro.diagnosis.batch import scores
from nnhydro.diagnosis.blocks import kept_rows, parts_of
from nnhydro.diagnosis.noise import flexible_noise, noise_of, quiet_noise
from nnhydro.diagnosis.own import Effects
from nnhydro.diagnosis.race import gains, price, ranked
from nnhydro.recordings.preprocessing import LowPass

PRIOR = np.array([4.0, 0.0, 50.0])
OWN = candidate("own", (), (2, 3))
MADE = tables(1, {0: 0.3})


def with_own_values(seed=2, units=6):
    """Tables in which columns 2 and 3 have values of each recording's own, drawn from N(0, 1)."""
    rng, made = np.random.default_rng(seed), tables(seed, {0: 0.3}, units=units)
    for table in made:
        value = rng.standard_normal(2)
        table[..., -1] += table[..., P + 2:P + 4] @ value
    return made


def left_out_errors(made, columns, prior):
    """D (units, joints): squared errors of each unit, predicted by a fit to all others, and theta of the fit to all."""
    r = rows(made)
    take = [*range(P), *(P + k for k in columns)]
    D = np.zeros((len(made), JOINTS))
    for u in range(len(made)):
        theta = fit(r.Z[r.unit != u][:, take], r.y[r.unit != u], prior)
        for j in range(JOINTS):
            here = (r.unit == u) & (r.joint == j)
            D[u, j] = ((r.y[here] - r.Z[here][:, take] @ theta) ** 2).sum()
    return D, fit(r.Z[:, take], r.y, prior)


@pytest.mark.parametrize("columns", [(), (0,), (0, 4)])
def test_the_score_is_the_documented_sum_over_refits_with_the_prior_and_its_cost(columns):
    scored = race(MADE, prior=PRIOR).bench.scored(np.array(columns, dtype=np.int64))
    D, theta = left_out_errors(MADE, columns, PRIOR)
    n = np.array([[len(table)] for table in MADE])
    by_unit = (n / 2 * np.log(np.maximum(D / n, 0.8))).sum(axis=1)
    np.testing.assert_allclose(scored.energy, D, rtol=1e-6)
    np.testing.assert_allclose(scored.by_unit, by_unit, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(scored.theta, theta, rtol=1e-6)
    assert scored.total == pytest.approx(by_unit.sum() + 0.5 * (PRIOR * theta[:P] ** 2).sum(), rel=1e-6)


def test_errors_below_four_fifths_of_the_noise_earn_nothing_and_errors_above_do():
    quiet = tables(3, noise=0.5 * NOISE)  # a quarter of the energy that the noise is said to have
    bench = race(quiet).bench
    at_floor = sum(JOINTS * len(table) / 2 * np.log(0.8) for table in quiet)
    assert bench.scored(np.array([], dtype=np.int64)).total == pytest.approx(at_floor, rel=1e-12)
    louder = race(tables(3, noise=0.95 * NOISE)).bench.scored(np.array([], dtype=np.int64)).total
    assert louder > at_floor + 1


def test_a_perfect_fit_has_an_energy_of_nothing_and_never_less():
    scored = race(tables(4, {1: 2.0}, noise=0 * NOISE)).bench.scored(np.array([1]))
    assert (scored.energy >= 0).all()
    assert scored.energy.max() < 1e-6


def test_a_column_that_is_another_one_leaves_the_fit_solvable_and_its_prediction_the_same():
    made = tables(5, {0: 0.5})
    for table in made:
        table[..., P + 1] = table[..., P]
    bench = race(made).bench
    alone, both = (bench.scored(np.array(columns)) for columns in ((0,), (0, 1)))
    np.testing.assert_allclose(both.energy, alone.energy, rtol=1e-5)
    assert both.theta[P] == pytest.approx(both.theta[P + 1], rel=1e-4)
    assert both.theta[P] + both.theta[P + 1] == pytest.approx(alone.theta[P], rel=1e-5)


def test_a_column_of_zeros_changes_nothing():
    made = tables(5, {0: 0.5})
    for table in made:
        table[..., P + 1] = 0.0
    bench = race(made).bench
    alone, both = (bench.scored(np.array(columns)) for columns in ((0,), (0, 1)))
    assert both.total == pytest.approx(alone.total, rel=1e-9)
    assert both.theta[P + 1] == 0.0


def marginal(made, take, own, v):
    """Plain rows of each recording, and the covariance of its torque when values of its own N(0, diag v) are integrated over."""
    r = rows(made)
    here = [r.unit == u for u in range(len(made))]
    return [(r.Z[i][:, take], r.y[i], np.eye(i.sum()) + (r.Z[i][:, own] * v) @ r.Z[i][:, own].T) for i in here]


def effects_of(bench, take, own):
    return Effects.of(bench.by_unit[0].sum(axis=1), take, own, 1e-9 * np.eye(len(take)))


def test_the_common_fit_weighs_every_row_by_what_a_recordings_own_values_may_add():
    made = with_own_values()
    bench, take, own = race(made).bench, np.array([*range(P), P]), P + np.array([2, 3])
    theta, left_out = bench.left_out(take, own)
    parts = marginal(made, take, own, bench._fitted(take, own)[2].v)
    A = [Y.T @ np.linalg.solve(S, Y) for Y, _, S in parts]
    g = [Y.T @ np.linalg.solve(S, y) for Y, y, S in parts]
    np.testing.assert_allclose(theta, np.linalg.solve(sum(A), sum(g)), rtol=1e-6)
    for u in range(len(made)):
        np.testing.assert_allclose(left_out[u], np.linalg.solve(sum(A) - A[u], sum(g) - g[u]), rtol=1e-6)


def test_the_spreads_are_those_under_which_all_recordings_are_likeliest_and_those_that_were_drawn():
    made = with_own_values(units=60)
    bench, take, own = race(made).bench, np.array([*range(P), P]), P + np.array([2, 3])
    found = effects_of(bench, take, own)

    def likelihood(v):
        H, g = replace(found, v=v).eliminated()
        theta = np.linalg.solve(H.sum(axis=0), g.sum(axis=0))
        return sum(multivariate_normal(cov=S).logpdf(y - Y @ theta) for Y, y, S in marginal(made, take, own, v))

    best = likelihood(found.v)
    assert found.v == pytest.approx([1.0, 1.0], rel=0.4), "of 60 draws"
    for k in range(2):
        for times in (0.7, 1.4):
            assert likelihood(np.where(np.arange(2) == k, times, 1.0) * found.v) < best


def test_the_spread_of_values_that_are_not_there_shrinks_below_what_a_fit_to_noise_would_give():
    made = tables(3, units=30)
    bench, take, own = race(made).bench, np.arange(P), P + np.array([2, 3])
    r = rows(made)
    left = r.y - r.Z[:, take] @ fit(r.Z[:, take], r.y)
    alone = [np.linalg.lstsq(r.Z[r.unit == u][:, own], left[r.unit == u], rcond=None)[0] for u in range(len(made))]
    assert (effects_of(bench, take, own).v < 0.5 * np.mean(np.square(alone), axis=0)).all()


def test_values_of_a_recordings_own_that_are_not_there_cost_little_and_explain_nothing():
    for seed in range(5):
        bench, none = race(tables(seed, units=12)).bench, np.zeros(0, np.int64)
        without, some = bench.scored(none), bench.scored(none, np.array([2, 3]))
        assert -1 < some.total - without.total < 15
        assert some.energy.sum() > 0.999 * without.energy.sum()


def test_of_two_columns_that_hardly_differ_within_a_recording_the_spread_keeps_the_values_small():
    made = with_own_values(units=12)
    for table in made:
        table[..., P + 4] = table[..., P + 3] + 1e-4 * table[..., P + 4]
    bench, none = race(made).bench, np.zeros(0, np.int64)
    alone, both = (bench.scored(none, np.array(own)).total for own in ((2, 3), (2, 3, 4)))
    assert both < alone + 10, "a fit alone would take any difference of the two, and predict the next block by it"


def test_a_block_is_predicted_by_the_value_that_its_recordings_other_blocks_taught_the_nearest_most():
    made = with_own_values()
    r, bench = rows(made), race(made).bench
    take, own = np.array([*range(P), P]), P + np.array([2, 3])
    theta = bench.left_out(take, own)[1]
    values, v = bench.own_values(take, own, theta), bench._fitted(take, own)[2].v
    scored, D = bench.scored(np.array([0]), np.array([2, 3])), np.zeros((len(made), JOINTS))
    for b in range(int(r.block.max()) + 1):
        u = int(r.unit[r.block == b][0])
        others = [c for c in sorted(set(r.block[r.unit == u])) if c != b]
        A, g = np.diag(1 / v), np.zeros(2)
        for c in others:
            X, left = r.Z[r.block == c][:, own], r.y[r.block == c] - r.Z[r.block == c][:, take] @ theta[u]
            weight = np.exp(-(abs(c - b) - 1.0))  # neighbours count in full, those further on by 1/e less a block
            A, g = A + weight * X.T @ X, g + weight * X.T @ left
        a = np.linalg.solve(A, g)
        np.testing.assert_allclose(values[b], a, rtol=1e-6)
        for j in range(JOINTS):
            here = (r.block == b) & (r.joint == j)
            D[u, j] += ((r.y[here] - r.Z[here][:, take] @ theta[u] - r.Z[here][:, own] @ a) ** 2).sum()
    np.testing.assert_allclose(scored.energy, D, rtol=1e-6)


def test_a_recording_of_one_block_has_no_value_of_its_own():
    made = [table[:12] for table in tables(6)]
    bench = race(made).bench
    take, own = np.arange(P), P + np.array([2])
    assert len(bench.blocks.n) == len(made)
    theta = bench.left_out(take, own)[1]
    assert (bench.own_values(take, own, theta) == 0).all()
    plain = bench.scored(np.array([], dtype=np.int64), np.array([2])).energy
    for u, table in enumerate(made):
        left = (table[..., -1] - table[..., :P] @ theta[u]) / NOISE
        np.testing.assert_allclose(plain[u], (left**2).sum(axis=0), rtol=1e-6)


@pytest.mark.parametrize("width", [1, 2])
def test_a_batch_gives_the_totals_and_values_of_one_after_the_other(width):
    bench = race(MADE, prior=PRIOR).bench
    groups = [tuple(sorted({k, (k + 3) % K})) if width == 2 else (k,) for k in (1, 3, 5)]
    for chosen in ((), (0,), (0, 2)):
        totals, values = scores(bench, np.array(chosen, dtype=np.int64), groups)
        for total, value, group in zip(totals, values, groups, strict=True):
            if set(group) & set(chosen):
                continue
            columns = np.array([*chosen, *group])
            D, theta = left_out_errors(MADE, columns, PRIOR)
            n = np.array([[len(table)] for table in MADE])
            want = (n / 2 * np.log(np.maximum(D / n, 0.8))).sum() + 0.5 * (PRIOR * theta[:P] ** 2).sum()
            assert total == pytest.approx(want, rel=1e-6)
            np.testing.assert_allclose(value, theta[P:], rtol=1e-5)


def test_a_batch_larger_than_a_chunk_keeps_the_order_of_its_candidates():
    made = tables(7, {3: 0.4}, units=4)
    bench, groups = race(made).bench, [(k % K,) for k in range(150)]
    totals, values = scores(bench, np.array([], dtype=np.int64), groups)
    assert totals.shape == (150,)
    np.testing.assert_allclose(totals, np.resize(totals[:K], 150), rtol=1e-12)
    np.testing.assert_allclose(values[:, 0], np.resize(values[:K, 0], 150), rtol=1e-9)
    assert int(np.argmin(totals[:K])) == 3


def test_a_batch_of_copies_of_a_chosen_column_stays_solvable():
    made = tables(5, {0: 0.5})
    for table in made:
        table[..., P + 1] = table[..., P]
    totals, _ = scores(race(made).bench, np.array([0]), [(1,), (2,)])
    alone = race(made).bench.scored(np.array([0])).total
    assert totals[0] == pytest.approx(alone, abs=1e-2)


def test_the_price_is_one_a_column_and_half_the_logarithm_of_the_grid():
    assert price([candidate("a", (0,)), candidate("b", (1, 2), grid=9), candidate("c", (3,), (4, 5))]) == pytest.approx(6 + 0.5 * np.log(9))
    assert price([]) == 0.0


def test_what_a_set_costs_is_its_score_and_its_price_and_what_it_gains_is_the_difference():
    found = race(tables(8, {0: 0.4, 4: 0.4}), chosen=(4,))
    one = SINGLE[0]
    D = found.bench.scored(np.array([0, 4])).total
    assert found.total([one]) == pytest.approx(D + 2)
    assert found.total() == pytest.approx(found.bench.scored(np.array([4])).total + 1)
    assert found.total([one], [SINGLE[4]]) == pytest.approx(found.bench.scored(np.array([0])).total + 1)
    assert gains(found, [one])[0][0] == pytest.approx(found.total() - found.total([one]))
    ((gain, _),) = gains(found, [one], [SINGLE[4]])
    assert gain == pytest.approx(found.total(without=[SINGLE[4]]) - found.total([one], [SINGLE[4]]))


def test_beside_values_of_a_recordings_own_a_gain_is_that_of_the_whole_set():
    bank = (*SINGLE[:2], *SINGLE[4:], OWN)
    found = race(with_own_values(), bank, chosen=(4,))
    for gain, one in gains(found, bank[:4]):
        assert gain == pytest.approx(found.total() - found.total([one]), rel=1e-9)
    alone = race(with_own_values(), bank)
    by_name = {c.key[0]: gain for gain, c in gains(alone, bank)}
    assert by_name["own"] == pytest.approx(alone.total() - alone.total([OWN]), rel=1e-9)
    assert by_name["own"] > 50 > by_name["effect_1"]


def test_candidates_are_ranked_by_gain_the_best_of_every_key_and_none_that_is_chosen():
    same = candidate("effect_0", (4,))
    bank = (*SINGLE, same, candidate("effect_0", (4,), joint=2))
    found = race(tables(9, {4: 0.5, 0: 0.2, 3: -0.3}), bank)
    order = ranked(found, bank)
    assert [gain for gain, _ in order] == sorted((gain for gain, _ in order), reverse=True)
    assert len(order) == K + 1
    assert next(c for _, c in order if c.key == ("effect_0", 0)) is same, "column 4 gains more than column 0"
    found.chosen = [bank[4]]
    assert bank[4].key not in [c.key for _, c in ranked(found, bank)]
    assert bank[4].key in [c.key for _, c in ranked(found, bank, [bank[4]])]


def test_the_values_of_a_set_are_those_of_its_common_fit():
    found = race(MADE, prior=PRIOR)
    z, by_column = found.values([SINGLE[4], SINGLE[0]])
    r = rows(MADE)
    theta = fit(r.Z[:, [0, 1, 2, P, P + 4]], r.y, PRIOR)
    np.testing.assert_allclose(z, theta[:P], rtol=1e-6)
    assert by_column == pytest.approx({0: theta[P], 4: theta[P + 1]}, rel=1e-5)


@pytest.mark.parametrize(("rows_", "lengths"), [
    (7, [7]), (15, [15]), (16, [8, 8]), (24, [8, 8, 8]), (32, [8, 8, 8, 8]), (90, [23, 23, 22, 22]),
])
def test_a_recording_falls_into_at_most_four_blocks_of_at_least_eight_rows(rows_, lengths):
    parts = parts_of(rows_, 4)
    assert [part.stop - part.start for part in parts] == lengths
    assert [k for part in parts for k in range(part.start, part.stop)] == list(range(rows_))


@pytest.mark.parametrize(("cutoff", "dt", "stride"), [(None, 0.01, 1), (4.0, 0.01, 10), (4.0, 0.02, 5), (8.0, 0.01, 5), (40.0, 0.01, 1)])
def test_rows_are_thinned_to_five_in_two_periods_of_the_cut_off(cutoff, dt, stride):
    keep = np.ones(400, dtype=bool)
    keep[:50] = False
    segment = SimpleNamespace(low_pass=None if cutoff is None else LowPass(cutoff), dt=dt, keep=keep)
    np.testing.assert_array_equal(kept_rows(segment), np.arange(50, 400, stride))


def test_the_noise_of_a_joint_is_what_a_flexible_fit_leaves_of_it():
    made = tables(14, {1: 0.7}, rows=(300, 400))
    blocks, prior = blocks_of(made), np.zeros(P)
    noise = flexible_noise(blocks, prior)
    every, n = rows(made, np.ones(JOINTS)), sum(len(table) for table in made)
    for j in range(JOINTS):
        Z, y = every.Z[every.joint == j], every.y[every.joint == j]
        left = y - Z @ np.linalg.lstsq(Z, y, rcond=None)[0]
        assert noise[j] == pytest.approx(np.sqrt((left**2).sum() / (n - Z.shape[1] / 2)), rel=1e-5)
    np.testing.assert_allclose(noise, NOISE, rtol=0.1)


def test_a_prior_on_the_baseline_leaves_what_it_forbids_to_the_noise():
    made = tables(15)
    free, held = (flexible_noise(blocks_of(made), np.full(P, x)) for x in (0.0, 1e9))
    own = np.concatenate([(table[..., :P] @ TRUTH) ** 2 for table in made])  # of the baseline's torque
    assert (held > 0.9 * np.sqrt(own.mean())).all()
    assert (free < 1.1 * NOISE).all()


def test_repeats_can_lower_the_noise_and_never_raise_it_and_none_is_nothing():
    made = tables(16)
    blocks, prior = blocks_of(made), np.zeros(P)
    alone = flexible_noise(blocks, prior)
    np.testing.assert_allclose(noise_of(blocks, prior, None), alone)
    np.testing.assert_allclose(noise_of(blocks, prior, (0.1, 9.0)), [0.1, alone[1]])
    silent = blocks_of(tables(16, noise=0 * NOISE))
    torque = np.sqrt(np.concatenate([table[..., -1] ** 2 for table in tables(16, noise=0 * NOISE)]).mean(axis=0))
    np.testing.assert_allclose(noise_of(silent, prior, (0.0, 0.0)), 1e-6 * torque, rtol=1e-6)


def test_the_tighter_the_prior_the_more_is_left_to_the_noise_up_to_all_that_the_baseline_told():
    blocks = blocks_of(tables(7))
    told = np.array([flexible_noise(blocks, np.full(P, prior)) for prior in (0.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e12)])
    assert (np.diff(told, axis=0) > 0).all()
    r = rows(tables(7), np.ones(2))
    for j in range(2):
        X, y = r.Z[r.joint == j][:, P:], r.y[r.joint == j]
        left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
        assert told[-1, j] == pytest.approx(np.sqrt((left**2).sum() / (len(y) - (P + K) / 2)), rel=1e-3)


def test_one_joint_has_a_quiet_noise_too():
    made = [table[:, :1] for table in tables(9, units=8)]
    np.testing.assert_allclose(quiet_noise(blocks_of(made), np.zeros(P)), quiet_noise(blocks_of(tables(9, units=8)), np.zeros(P))[:1])
