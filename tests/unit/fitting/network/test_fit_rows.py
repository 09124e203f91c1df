"""Pieces of the fits on plain rows: ridges, what is watched, weights, bounds, notes, intervals and where rows are kept."""


import numpy as np
import pytest
import torch
from campaigns import recording
from rigs import arm

from nnhydro.errors import ConfigError
from nnhydro.fitting.config import read_config
from nnhydro.fitting.hyperparameters import _suggest
from nnhydro.fitting.identify import _notes, estimates
from nnhydro.fitting.linear.least_squares import Solution, correlation_time, joint_weights, solve
from nnhydro.fitting.linear.prior import Prior, prior
from nnhydro.fitting.linear.statistics import Statistics, block, columns_and_offset, residual_energy, total, weight_joints
from nnhydro.fitting.network.linear_columns import Linear, RowRange
from nnhydro.fitting.network.row_store import RowStore
from nnhydro.fitting.regressor import TorqueRegressor, _ridge
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LinearTerm
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.motion import Motion
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.recordings.filtering.preprocessing import Preparation, prepare


def test_a_ridge_takes_the_penalty_that_does_best_on_the_rows_it_does_not_train_on():
    rng = np.random.default_rng(1)
    x, train, usable = rng.standard_normal((80, 6)), np.arange(80) < 30, np.array([True] * 5 + [False])
    y = x @ rng.standard_normal((6, 2)) * 0.3 + rng.standard_normal((80, 2))
    A, errors = x[train][:, usable], {}
    for k in range(8):
        K = np.linalg.solve(A.T @ A + 10.0**-k * 30 * np.eye(5), A.T @ y[train])
        errors[k] = float(((x[~train][:, usable] @ K - y[~train]) ** 2).sum()), K
    best = min(errors.values(), key=lambda pair: pair[0])[1]
    found = _ridge(x, y, train, usable)
    np.testing.assert_allclose(found[:5], best)
    assert (found[5] == 0).all()
    every = np.linalg.solve(x.T @ x + 1e-3 * 80 * np.eye(6), x.T @ y)
    np.testing.assert_allclose(_ridge(x, y, np.ones(80, dtype=bool), np.ones(6, dtype=bool)), every)


@pytest.mark.parametrize(("n", "groups", "share", "watched", "units"), [
    (100, None, 0.15, 3, 20), (100, None, 0.5, 10, 20), (9, None, 0.15, 0, 9), (10, None, 0.15, 2, 10), (12, [1, 2] * 6, 0.9, 1, 2),
    (12, [1] * 12, 0.5, 0, 1), (100, list(range(50)) * 2, 0.1, 5, 50),
])
def test_a_share_of_the_rows_or_groups_is_watched_where_there_are_enough(n, groups, share, watched, units):
    unit, told = TorqueRegressor(members=2, validation_share=share)._watched_units(n, groups, np.random.RandomState(1))
    assert told.shape == (2, units)
    assert told.sum(dim=1).tolist() == [watched] * 2
    assert torch.equal(told[0], told[1])
    assert len(unit) == n
    if groups is not None:
        assert all(len({unit[i] for i in range(n) if groups[i] == g}) == 1 for g in set(groups))
    else:
        assert np.ptp(np.bincount(unit)) <= 1


def test_a_member_that_does_not_help_adds_nothing():
    rng = np.random.default_rng(1)
    x = rng.standard_normal((200, 3))
    y = x @ np.array([1.0, -1.0, 0.5]) + 0.5 * rng.standard_normal(200)
    made = TorqueRegressor(hidden=(4,), epochs=3, members=2).fit(x, y)
    plain = made.offset_ + made._inputs(x) @ made.linear_
    assert np.abs(made.predict(x) - plain[:, 0]).max() < 0.2 * 0.5
    curved = TorqueRegressor(hidden=(16,), epochs=150, members=2, learning_rate=2e-2).fit(x, np.sin(3 * x[:, 0]))
    assert ((curved.predict(x) - np.sin(3 * x[:, 0])) ** 2).mean() < 0.1
    tau, std = curved.predict(x, return_std=True)
    assert tau.shape == std.shape == (200,)
    both = TorqueRegressor(hidden=(4,), epochs=2).fit(x, np.stack([y, 100 * y], axis=1))
    assert both.predict(x).shape == (200, 2)
    np.testing.assert_allclose(both.predict(x)[:, 1], 100 * both.predict(x)[:, 0], rtol=0.3, atol=30)


def statistics(seed=1, n=200):
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, 2, 3))
    y = X @ np.array([1.0, 2.0, -1.0]) + [0.1, 1.0] * rng.standard_normal((n, 2))
    return X, y, block(X, y)


def test_the_weighted_penalised_fit_is_that_of_the_rows_with_the_prior_as_further_ones():
    X, y, stats = statistics()
    F, mean, weight = np.array([[1.0, 0], [0.2, 1.0], [0.0, 0.5]]), np.array([0.5, 0.0, -1.0]), np.array([4.0, 0.25])
    before = Prior(mean, F, np.full(2, -np.inf), np.full(2, np.inf))
    rows = np.concatenate([np.sqrt(weight[j]) * X[:, j] @ F for j in range(2)] + [np.eye(2)])
    right = np.concatenate([np.sqrt(weight[j]) * (y[:, j] - X[:, j] @ mean) for j in range(2)] + [np.zeros(2)])
    z = np.linalg.lstsq(rows, right, rcond=None)[0]
    told = solve(stats, before, weight)
    np.testing.assert_allclose(told.theta, mean + F @ z, rtol=1e-9)
    np.testing.assert_allclose(told.covariance, F @ np.linalg.inv(rows.T @ rows) @ F.T, rtol=1e-9)
    left = y - X @ told.theta
    np.testing.assert_allclose(told.rms, np.sqrt((left**2).mean(axis=0)), rtol=1e-6)
    np.testing.assert_allclose(residual_energy(stats, told.theta), (left**2).sum(axis=0), rtol=1e-6)
    assert not told.at_bound.any()
    A = rows.T @ rows
    scale = 1 / np.sqrt(np.diag(A))
    assert told.condition == pytest.approx(np.linalg.cond(A * np.outer(scale, scale)))
    H, g = weight_joints(stats, weight)
    np.testing.assert_allclose(H, sum(weight[j] * X[:, j].T @ X[:, j] for j in range(2)))
    np.testing.assert_allclose(g, sum(weight[j] * X[:, j].T @ y[:, j] for j in range(2)))
    both = total([stats, stats])
    np.testing.assert_allclose(both.n, [400, 400])
    np.testing.assert_allclose(both.s, 2 * (y**2).sum(axis=0))


def test_bounded_directions_stop_at_their_bounds_and_the_others_make_the_best_of_it():
    X, y, stats = statistics()
    before = Prior(np.zeros(3), np.eye(3), np.array([-np.inf, -np.inf, -0.5]), np.array([np.inf, 1.5, np.inf]))
    told = solve(stats, before, np.array([100.0, 1.0]))
    assert told.theta[1:] == pytest.approx([1.5, -0.5])
    np.testing.assert_array_equal(told.at_bound, [False, True, True])
    left = y - X[..., 1:] @ [1.5, -0.5]
    A, b = 1 + 100 * X[:, 0, 0] @ X[:, 0, 0] + X[:, 1, 0] @ X[:, 1, 0], 100 * X[:, 0, 0] @ left[:, 0] + X[:, 1, 0] @ left[:, 1]
    assert told.theta[0] == pytest.approx(b / A)
    near = Prior(np.zeros(3), np.eye(3), np.full(3, -np.inf), np.array([np.inf, 2.05, np.inf]))
    assert not solve(stats, near, np.array([100.0, 1.0])).at_bound.any()


def test_a_joint_weighs_by_its_residual_and_its_correlation_down_to_a_millionth_of_its_torque():
    X, y, stats = statistics()
    before = Prior(np.zeros(3), np.eye(3), np.full(3, -np.inf), np.full(3, np.inf))
    np.testing.assert_allclose(joint_weights(stats, before, np.array([0.1, 2.0]), np.array([5.0, 0.5])), [1 / (0.01 * 5), 1 / 4.0])
    size = np.sqrt((y**2).mean(axis=0))
    np.testing.assert_allclose(joint_weights(stats, before, np.zeros(2), np.ones(2)), 1 / (1e-6 * size) ** 2, rtol=1e-9)
    expected = Prior(np.array([50.0, 0.0, 0.0]), np.eye(3), np.full(3, -np.inf), np.full(3, np.inf))
    size = 50 * np.sqrt((X[..., 0] ** 2).mean(axis=0))
    np.testing.assert_allclose(joint_weights(stats, expected, np.zeros(2), np.ones(2)), 1 / (1e-6 * size) ** 2, rtol=1e-9)
    silent = Statistics(0 * stats.H, 0 * stats.g, 0 * stats.s, 0 * stats.n)
    assert np.isfinite(joint_weights(silent, before, np.zeros(2), np.ones(2))).all()


@pytest.mark.parametrize("phi", [0.5, 0.9])
def test_the_correlation_time_is_one_plus_twice_the_sum_of_correlations(phi):
    rng = np.random.default_rng(1)
    from scipy.signal import lfilter
    x = lfilter([1.0], [1.0, -phi], rng.standard_normal(200_000)) + 100.0
    assert correlation_time(x) == pytest.approx((1 + phi) / (1 - phi), rel=0.1)
    assert correlation_time(x[:7]) == 1.0
    assert correlation_time(np.tile([1.0, -1.0], 50)) == 1.0


def noted(theta, sd, bounds=(0.2, 2.5), mean=1.1, known=1.0):
    """The note on one drag coefficient."""
    loads = Loads({"drag": NormalDrag((theta,))})
    told = Solution(np.array([theta]), np.array([[sd**2]]), np.ones(1), np.ones(1), np.zeros(1, dtype=bool), 1.0)
    before = Prior(np.array([mean]), np.array([[known]]), np.array([-9.0]), np.array([9.0]))
    return _notes(loads, told, before)[0]


def test_notes_say_what_must_not_be_taken_at_face_value():
    low, high = NormalDrag((1.0,)).linear_bounds()[0]
    assert noted(1.0, 0.1) == ""
    assert noted(low, 0.1) == noted(high, 0.1) == "ended on its bound: another cause may be hiding here"
    assert noted(low + 1e-6, 0.1) == noted(high - 1e-6, 0.1) == ""
    assert noted(1.2, 0.71).endswith("the value is what was assumed")
    assert noted(1.2, 0.69) == ""
    assert noted(1.59, 0.71).endswith("the value is what was assumed")
    assert noted(1.61, 0.71).endswith("it moved within its uncertainty")
    assert noted(1.11, 0.01, known=0.01).endswith("it moved within its uncertainty")
    assert noted(1.2, 0.01, known=0.01).endswith("it moved 10 times its uncertainty")
    assert noted(1.0, 0.1, known=0.0) == "known exactly beforehand"


def test_two_recordings_have_gaussian_intervals_and_three_are_resampled():
    a = arm(1)
    loads = Loads({"drag": NormalDrag((1.0,))})
    rng = np.random.default_rng(1)
    blocks = []
    for _ in range(3):
        X = rng.standard_normal((100, 1, 1))
        blocks.append(block(X, X[..., 0] + 0.3 * rng.standard_normal((100, 1))))
    before = prior(loads, a)
    told = solve(total(blocks[:2]), before, np.array([1 / 0.09]))
    (one,) = estimates(loads, told, blocks[:2], before, 0)
    sd = np.sqrt(told.covariance[0, 0])
    assert one.ci95 == pytest.approx((told.theta[0] - 1.96 * sd, told.theta[0] + 1.96 * sd))
    (many,) = estimates(loads, solve(total(blocks), before, np.array([1 / 0.09])), blocks, before, 0)
    assert 0.2 < (many.ci95[1] - many.ci95[0]) / (one.ci95[1] - one.ci95[0]) < 1.5
    assert one.document() == {"value": one.value, "unit": "1", "ci95": list(one.ci95)}


def test_what_two_stretches_hold_at_most_is_what_either_holds():
    def of(low, high, swift):
        return RowRange(*(torch.tensor(x) for x in (low, high, swift)))
    both = of([1.0, -2.0], [3.0, 0.0], [5.0]).and_of(of([0.0, -1.0], [2.0, 4.0], [6.0]))
    assert (both.lowest.tolist(), both.highest.tolist(), both.swiftest.tolist()) == ([0.0, -2.0], [3.0, 4.0], [6.0])
    one, other = (Linear(torch.full((n, 1, 3), float(n)), 2, 2, 0, torch.zeros(2), of([0.0], [1.0], [1.0])) for n in (2, 4))
    assert one.and_of(other).columns.shape == (6, 1, 3)


def test_rows_that_exceed_the_budget_lie_in_files_and_those_that_just_fit_do_not():
    part = (torch.arange(6.0).reshape(3, 2), torch.arange(3))
    size = 6 * 4 + 3 * 8
    for budget, mapped in ((2 * size, False), (2 * size - 1, True), (0, True)):
        with RowStore(budget) as store:
            store.append(part)
            store.append(part)
            assert store.mapped == mapped
            x, k = store.columns()
            assert torch.equal(x, torch.cat([part[0]] * 2))
            assert torch.equal(k, torch.cat([part[1]] * 2))


def test_two_floats_are_the_ends_of_a_range_and_all_else_is_a_list_of_values():
    asked = []

    class Trial:
        def suggest_float(self, name, low, high, log):
            asked.append((name, low, high, log))
            return 0.5

        def suggest_categorical(self, name, places):
            asked.append((name, places))
            return places[-1]

    made = _suggest(Trial(), {"rate": (0.1, 1.0), "hidden": ((8,), (16, 16)), "epochs": (10, 20), "three": (0.1, 0.2, 0.3)})
    assert made == {"rate": 0.5, "hidden": (16, 16), "epochs": 20, "three": 0.3}
    assert asked[0] == ("rate", 0.1, 1.0, True)


def test_a_model_without_linear_terms_has_no_columns_and_its_whole_torque_beside_them():
    a = arm(2)
    loads = Loads({name: term for name, term in state_loads(a).terms.items() if not isinstance(term, LinearTerm)})
    segment = next(iter(prepare(recording(a, Loads({"drag": NormalDrag((1.0, 1.0))}), seconds=0.5), Preparation(None))))
    X, c0 = columns_and_offset(loads, segment, a)
    assert X.shape == (len(segment), 2, 0)
    np.testing.assert_allclose(c0, loads.torque(Flow(a, Motion.of(segment))))
    assert np.abs(c0).max() > 0


def test_a_configuration_that_is_not_there_says_so_in_the_systems_words(tmp_path):
    with pytest.raises(ConfigError, match=r"none.toml: cannot be read \(No such file or directory\): check the path"):
        read_config(tmp_path / "none.toml")


def test_of_nothing_nothing_is_known_beforehand():
    none = prior(Loads({}), arm(2))
    assert [x.shape for x in (none.mean, none.F, none.lowest, none.highest)] == [(0,), (0, 0), (0,), (0,)]


def test_a_fold_is_judged_by_a_model_that_has_not_seen_it(monkeypatch):
    from nnhydro.fitting import hyperparameters as search

    monkeypatch.setattr(search, "train_units", lambda chosen, *given: [*chosen])
    seen = search._fold_error(["a", "b", "c", "d"], [1, 3], None, None, None, lambda model, judged: (model, judged))
    assert seen == (["a", "c"], ["b", "d"])
