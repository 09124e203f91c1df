"""Steps, rates and early stopping of the ensemble."""

import numpy as np
import pytest
import torch
from training_rows import some_rows

from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.network import gradient_fit as gradient
from nnhydro.fitting.network.gradient_fit import TrainingState, _Task, _watch, adamw_step, cycle, gradient_fit
from nnhydro.models.learned.network import Ensemble, odd_output


def every_row(rows, members=2):
    return torch.arange(len(rows.x)).expand(members, -1)


def test_steps_are_those_of_AdamW_as_published():
    rng, start = np.random.default_rng(1), np.random.default_rng(2).standard_normal((2, 4, 3))
    weights, first, second = [torch.tensor(w) for w in start], *([torch.zeros(4, 3).double() for _ in start] for _ in range(2))
    w, m, v, rate, decay = start.copy(), np.zeros_like(start), np.zeros_like(start), 3e-2, 0.2
    for step in range(1, 8):
        g = rng.standard_normal(w.shape)
        adamw_step(weights, [torch.tensor(slope) for slope in g], first, second, step, rate, decay)
        m, v = 0.9 * m + 0.1 * g, 0.99 * v + 0.01 * g**2
        w = w - rate * (m / (1 - 0.9**step) / (np.sqrt(v / (1 - 0.99**step)) + 1e-8) + decay * w)
    np.testing.assert_allclose(torch.stack(weights), w, rtol=1e-9)


def test_the_rate_rises_over_a_twentieth_and_falls_by_half_a_cosine_to_a_hundredth():
    assert cycle(0.0) == pytest.approx(0.1)
    assert cycle(0.025) == pytest.approx(0.55)
    assert cycle(0.05) == pytest.approx(1.0)
    assert cycle(0.525) == pytest.approx(0.505)
    assert cycle(1.0) == pytest.approx(0.01)
    rates = [cycle(x) for x in np.linspace(0.05, 1, 50)]
    assert (np.diff(rates) < 0).all()


@pytest.mark.parametrize("linear", [False, True])
def test_the_error_of_a_row_is_what_linear_part_and_network_leave_in_units_of_the_torque(linear):
    rows, ensemble = some_rows(linear=linear), Ensemble.fresh((3, 5, 2), 2, 1)
    ensemble = ensemble.with_tensors([torch.randn(t.shape, generator=torch.Generator().manual_seed(k)) for k, t in
                                  enumerate(ensemble.tensors())])
    left = (rows.target - rows.scale * rows.linear.transpose(0, 1)) if linear else rows.target.expand(1, -1, -1)
    r = (left / rows.scale).pow(2).mean(dim=1, keepdim=True).sqrt()
    said = rows.scale * r * odd_output(ensemble, rows.x, rows.parity)
    want = (((said - left) / rows.target.pow(2).mean(dim=0).sqrt()) ** 2).sum(dim=2)
    torch.testing.assert_close(_Task.of(rows).errors(ensemble, every_row(rows)), want, rtol=1e-5, atol=1e-6)


def test_every_step_follows_the_slope_of_each_members_mean_error_over_the_rows_that_it_may_use(monkeypatch):
    rows, layout = some_rows(n=50), Ensemble.fresh((3, 4, 2), 2, 1)
    state, task, train = TrainingState.fresh(layout), _Task.of(rows), torch.ones(2, 50, dtype=torch.bool)
    train[1, 7:] = False  # member 2 finds seven rows, in one of the two batches perhaps none
    kept = []
    monkeypatch.setattr(gradient, "adamw_step", lambda weights, slopes, *given: kept.append(slopes))
    gradient._epoch(state, layout, task, train, TrainingConfig(batch=30, seed=4), torch.ones(2, dtype=torch.bool))
    order = torch.randperm(50, generator=torch.Generator().manual_seed(4 * 1_000_003))
    for slopes, index in zip(kept, (order[:30], order[30:]), strict=True):
        weights = [w.clone().requires_grad_(True) for w in state.weights]
        errors = task.errors(layout.with_tensors(weights), every_row(rows))
        mean = [errors[k, [i for i in index.tolist() if train[k, i]]].mean().nan_to_num(0.0) for k in range(2)]
        for told, want in zip(slopes, torch.autograd.grad(sum(mean), weights, materialize_grads=True), strict=True):
            torch.testing.assert_close(told, want, rtol=1e-4, atol=1e-6)


def test_members_keep_the_weights_with_which_the_rows_that_they_watch_were_predicted_best():
    rows, layout = some_rows(), Ensemble.fresh((3, 4, 2), 2, 1)
    state, watch = TrainingState.fresh(layout), torch.zeros(2, 60, dtype=torch.bool)
    watch[0, :30] = watch[1, 30:] = True
    task = _Task.of(rows)
    _watch(state, layout, task, watch, torch.ones(2, dtype=torch.bool))
    errors = task.errors(layout.with_tensors(state.weights), every_row(rows))
    torch.testing.assert_close(state.best_error, torch.stack([errors[0, :30].mean(), errors[1, 30:].mean()]))
    assert state.history == []
    first = [w.clone() for w in state.best]
    state.epoch, state.best_error = 3, torch.tensor([0.0, 1e9])
    state.weights = [w + 0.1 for w in state.weights]
    _watch(state, layout, task, watch, torch.ones(2, dtype=torch.bool))
    assert state.best_epoch.tolist() == [0.0, 3.0]
    for kept, old, new in zip(state.best, first, state.weights, strict=True):
        torch.testing.assert_close(kept[0], old[0])
        torch.testing.assert_close(kept[1], new[1])
    errors = task.errors(layout.with_tensors(state.weights), every_row(rows))
    assert state.history == [pytest.approx(float(errors[0, :30].mean() + errors[1, 30:].mean()) / 2)]


def test_a_training_stops_when_no_member_has_become_better_for_so_long_and_reports_every_epoch():
    rows, layout = some_rows(n=240), Ensemble.fresh((3, 6, 2), 2, 1)
    watched = torch.zeros(2, 6, dtype=torch.bool)
    watched[0, 0] = watched[1, 3] = True
    config, told, kept = TrainingConfig(epochs=30, patience=3, batch=64, learning_rate=0.5), [], []
    state = TrainingState.fresh(layout)
    gradient_fit(layout, rows, watched, config, state, lambda s: kept.append(s.epoch), lambda *given: told.append(given))
    assert kept == list(range(1, state.epoch + 1))
    joints = rows.target.shape[1]
    assert told == [(k, 30, pytest.approx(np.sqrt(error / joints))) for k, error in zip(kept, state.history, strict=True)]
    assert state.epoch == min(30, int(state.best_epoch.max()) + 3)
    assert len(state.history) == state.epoch
    short = TrainingState.fresh(layout)
    gradient_fit(layout, rows, watched, TrainingConfig(epochs=2, patience=100, batch=64), short)
    assert (short.epoch, short.steps) == (2, 8)


@pytest.mark.parametrize("parallel", [False, True])
def test_a_member_that_has_run_out_of_patience_stays_as_it_is_and_the_others_take_the_same_steps(parallel):
    rows, layout, config = some_rows(n=240), Ensemble.fresh((3, 6, 2), 3, 1, parallel), TrainingConfig(batch=64, patience=4)
    states, train = [TrainingState.fresh(layout) for _ in range(2)], torch.ones(3, 240, dtype=torch.bool)
    states[1].epoch, states[1].best_epoch = 0, torch.tensor([0.0, -4.0, 0.0])
    for state in states:
        gradient._epoch(state, layout, _Task.of(rows), train, config, state.learning(config.patience))
    for fresh, every, some in zip(layout.tensors(), states[0].weights, states[1].weights, strict=True):
        stopped = torch.tensor([False, True, False]).repeat_interleave(len(fresh) // 3)
        torch.testing.assert_close(some[stopped], fresh[stopped], rtol=0, atol=0)
        torch.testing.assert_close(some[~stopped], every[~stopped])


def test_a_network_learns_what_it_is_shown():
    rows, layout = some_rows(n=300), Ensemble.fresh((3, 12, 2), 2, 1)
    config = TrainingConfig(epochs=60, patience=60, batch=50, learning_rate=0.02, weight_decay=0.0)
    ensemble = gradient_fit(layout, rows, torch.zeros(2, 6, dtype=torch.bool), config, TrainingState.fresh(layout))
    said = rows.scale * odd_output(ensemble, rows.x.double(), rows.parity.double()).mean(dim=0)
    assert float((said - rows.target).pow(2).mean() / rows.target.pow(2).mean()) < 0.12  # the scale is drawn anew in every row
