"""Pieces of the fits on plain rows: ridges, what is watched, weights, bounds, notes, intervals and where rows are kept."""

import numpy as np
import pytest
import torch

from nnhydro.fitting.hyperparameters import _suggest
from nnhydro.fitting.network.linear_columns import Linear, RowRange
from nnhydro.fitting.regressor import TorqueRegressor, _ridge


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


def test_what_two_stretches_hold_at_most_is_what_either_holds():
    def of(low, high, swift):
        return RowRange(*(torch.tensor(x) for x in (low, high, swift)))
    both = of([1.0, -2.0], [3.0, 0.0], [5.0]).and_of(of([0.0, -1.0], [2.0, 4.0], [6.0]))
    assert (both.lowest.tolist(), both.highest.tolist(), both.swiftest.tolist()) == ([0.0, -2.0], [3.0, 4.0], [6.0])
    one, other = (Linear(torch.full((n, 1, 3), float(n)), 2, 2, 0, torch.zeros(2), of([0.0], [1.0], [1.0])) for n in (2, 4))
    assert one.and_of(other).columns.shape == (6, 1, 3)


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


def test_a_fold_is_judged_by_a_model_that_has_not_seen_it(monkeypatch):
    from nnhydro.fitting import hyperparameters as search

    monkeypatch.setattr(search, "train_units", lambda chosen, *given: [*chosen])
    seen = search._fold_error(["a", "b", "c", "d"], [1, 3], None, None, None, lambda model, judged: (model, judged))
    assert seen == (["a", "c"], ["b", "d"])
