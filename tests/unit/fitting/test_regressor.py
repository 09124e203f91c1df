"""TorqueRegressor is a scikit-learn estimator: its own checks, groups, grids, pipelines, several processes; and it learns what is there."""

import pickle

import numpy as np
import pytest
import torch
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks

from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.regressor import TorqueRegressor, _ridge

QUICK = {"hidden": (8,), "members": 1, "epochs": 20, "batch": 64}
BRIEF = {**QUICK, "epochs": 4}  # what is asked of an estimator does not depend on how long it learns


@pytest.mark.slow
@parametrize_with_checks([TorqueRegressor(**BRIEF), TorqueRegressor(**BRIEF | {"members": 2, "random_state": None})])
def test_it_is_an_estimator_of_scikit_learn(estimator, check):
    check(estimator)


def table(n=600, seed=1):
    """Features, two targets with a linear and a curved part, and 12 groups."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((n, 3))
    y = np.column_stack([2 * x[:, 0] + np.abs(x[:, 1]) * x[:, 1], 3 + x[:, 2] - np.tanh(2 * x[:, 0])])
    return x, y, np.arange(n) % 12


def nrmse(got, want):
    return float(np.sqrt(((got - want) ** 2).mean(0) / want.var(0)).max())


@pytest.mark.slow
def test_a_curve_is_learned_that_no_line_can_follow():
    x, y, _ = table()
    model = TorqueRegressor(epochs=120, batch=64).fit(x[:500], y[:500])
    line = model._inputs(x[500:]) @ model.linear_ + model.offset_
    assert nrmse(model.predict(x[500:]), y[500:]) < 0.05
    assert nrmse(line, y[500:]) > 0.2


def test_a_line_is_found_at_once():
    x, _, _ = table()
    y = x @ np.array([1.0, -2.0, 0.5]) + 3
    model = TorqueRegressor(epochs=1).fit(x[:500], y[:500])
    np.testing.assert_allclose(model.predict(x[500:]), y[500:], atol=1e-5)


def test_what_only_disturbs_is_left_to_the_line():
    rng = np.random.default_rng(1)
    x = rng.standard_normal((300, 4))
    y = x[:, 0] + rng.standard_normal(300)
    ours = TorqueRegressor(epochs=60, learning_rate=0.05, batch=32).fit(x[:150], y[:150])
    line = x[150:] @ np.linalg.lstsq(x[:150], y[:150], rcond=None)[0]
    assert nrmse(ours.predict(x[150:]), y[150:]) < 1.1 * nrmse(line, y[150:])


@pytest.mark.parametrize("parity", [(-1, -1, -1), (-1, -1, 1)])
def test_with_parity_the_estimate_is_exactly_odd(parity):
    x, y, _ = table(200)
    model = TorqueRegressor(**QUICK, parity=parity).fit(x, y)
    np.testing.assert_allclose(model.predict(x * np.array(parity)), -model.predict(x), atol=1e-12)


@pytest.mark.parametrize("parity", [(1, -1), (1, -1, 0), (2, 1, 1)])
def test_a_parity_that_fits_no_feature_is_refused(parity):
    x, y, _ = table(50)
    with pytest.raises(ValueError, match="parity must hold"):
        TorqueRegressor(**QUICK, parity=parity).fit(x, y)


def test_numbers_that_make_no_sense_are_refused_in_fit():
    x, y, _ = table(50)
    with pytest.raises(ValueError, match="members"):
        TorqueRegressor(members=0).fit(x, y)


def test_members_disagree_more_outside_the_data():
    x, y, _ = table()
    model = TorqueRegressor(members=4, epochs=40, batch=64).fit(x, y)
    mean, std = model.predict(x, return_std=True)
    assert std.shape == mean.shape == y.shape
    assert model.predict(4 * x, return_std=True)[1].mean() > 2 * std.mean()


def test_the_networks_are_as_large_as_those_of_a_training_where_nobody_says_otherwise():
    assert TorqueRegressor().get_params()["hidden"] == TrainingConfig().hidden


def test_networks_learn_in_units_of_what_the_line_leaves():
    rng = np.random.default_rng(1)
    x = rng.standard_normal((200, 3))
    y = 50.0 + 100.0 * x[:, 0] + 0.01 * np.sin(5 * x[:, 1])
    made = TorqueRegressor(hidden=(4,), epochs=1, members=1, validation_share=0.1).fit(x, y)
    left = y - made.offset_ - made._inputs(x) @ made.linear_[:, 0]
    assert made.scale_ == pytest.approx([np.sqrt((left**2).mean())], rel=1e-6)
    assert made.scale_[0] < 0.1


def test_whole_groups_are_watched():
    x, y, groups = table(240)
    model = TorqueRegressor(**QUICK)
    unit, watched = model._watched_units(len(x), groups, np.random.RandomState(0))
    rows = watched[0].numpy()[unit]
    assert {tuple(np.unique(rows[groups == g])) for g in range(12)} == {(True,), (False,)}
    assert int(watched[0].sum()) == 2
    assert nrmse(model.fit(x, y, groups=groups).predict(x), y) < 0.5


def test_the_same_seed_gives_the_same_model_and_another_another():
    x, y, _ = table(200)
    first, again, other = (TorqueRegressor(**QUICK, random_state=s).fit(x, y).predict(x) for s in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_it_works_in_pipelines_grids_groups_and_processes():
    x, y, groups = table(240)
    pipeline = make_pipeline(StandardScaler(), TorqueRegressor(**QUICK))
    scores = cross_val_score(pipeline, x, y, groups=groups, cv=GroupKFold(3), n_jobs=1)
    assert scores.min() > 0.5
    grid = GridSearchCV(TorqueRegressor(**QUICK), {"hidden": [(4,), (8, 8)]}, cv=GroupKFold(2)).fit(x, y, groups=groups)
    assert clone(grid.best_estimator_).get_params() == grid.best_estimator_.get_params()


@pytest.mark.slow
def test_it_fits_in_other_processes():
    x, y, groups = table(240)
    scores = cross_val_score(TorqueRegressor(**QUICK), x, y, groups=groups, cv=GroupKFold(2), n_jobs=2)
    np.testing.assert_allclose(scores, cross_val_score(TorqueRegressor(**QUICK), x, y, groups=groups, cv=GroupKFold(2)), rtol=1e-6)


def test_a_stored_estimator_predicts_the_same():
    x, y, _ = table(100)
    model = TorqueRegressor(**QUICK).fit(x, y[:, 0])
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(model)).predict(x), model.predict(x))
    assert model.predict(x).shape == (100,)


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
