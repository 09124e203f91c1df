"""Pieces of a training, each by itself: steps, rates, what is watched, rows, trust and doubt."""

from dataclasses import dataclass
from statistics import NormalDist
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from nnhydro.errors import CampaignError
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.network import gradient_fit as gradient
from nnhydro.fitting.network import predictive_std as doubt
from nnhydro.fitting.network.gradient_fit import TrainingState, _adamw, _rate, _Task, _watch, gradient_fit
from nnhydro.fitting.network.predictive_std import _factor, _variance_terms, conformal_quantile, support, with_std, with_trust
from nnhydro.fitting.network.rows import Rows, row_numbers, standardise, torque_rms, watched_units
from nnhydro.fitting.network.stacking import NETWORKS, losses, stack
from nnhydro.models.learned.learned import spread_of
from nnhydro.models.learned.network import Ensemble, odd_output
from nnhydro.recordings.filtering.low_pass import LowPass


def some_rows(n=60, units=6, joints=2, seed=1, linear=False):
    generator = torch.Generator().manual_seed(seed)
    parity = torch.tensor([-1.0, 1.0, -1.0])
    x = torch.randn(n, 3, generator=generator)
    target = 2 * x[:, [0]] * (1 + 0.5 * x[:, [1]]) + 0.1 * torch.randn(n, joints, generator=generator)
    scale = 0.5 + torch.rand(n, joints, generator=generator)
    part = 0.1 * torch.randn(n, 2, joints, generator=generator) if linear else None
    return Rows(x, parity, scale, target, torch.arange(n) % units, part)


def every_row(rows, members=2):
    return torch.arange(len(rows.x)).expand(members, -1)


def test_steps_are_those_of_AdamW_as_published():
    rng, start = np.random.default_rng(1), np.random.default_rng(2).standard_normal((2, 4, 3))
    state = TrainingState([torch.tensor(w) for w in start], *([torch.zeros(4, 3).double() for _ in start] for _ in range(3)),
                          torch.zeros(1), torch.zeros(1))
    w, m, v, rate, decay = start.copy(), np.zeros_like(start), np.zeros_like(start), 3e-2, 0.2
    for step in range(1, 8):
        g = rng.standard_normal(w.shape)
        _adamw(state, tuple(torch.tensor(slope) for slope in g), rate, decay)
        m, v = 0.9 * m + 0.1 * g, 0.99 * v + 0.01 * g**2
        w = w - rate * (m / (1 - 0.9**step) / (np.sqrt(v / (1 - 0.99**step)) + 1e-8) + decay * w)
    np.testing.assert_allclose(torch.stack(state.weights), w, rtol=1e-9)
    assert state.steps == 7


def test_the_rate_rises_over_a_twentieth_and_falls_by_half_a_cosine_to_a_hundredth():
    config = TrainingConfig(learning_rate=0.02)
    assert _rate(config, 0.0) == pytest.approx(0.002)
    assert _rate(config, 0.025) == pytest.approx(0.011)
    assert _rate(config, 0.05) == pytest.approx(0.02)
    assert _rate(config, 0.525) == pytest.approx(0.02 * 0.505, rel=1e-6)
    assert _rate(config, 1.0) == pytest.approx(0.0002, rel=1e-3)
    rates = [_rate(config, x) for x in np.linspace(0.05, 1, 50)]
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
    monkeypatch.setattr(gradient, "_adamw", lambda state, slopes, *given: kept.append(slopes))
    gradient._epoch(state, layout, task, train, TrainingConfig(batch=30, seed=4))
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
    _watch(state, layout, task, watch)
    errors = task.errors(layout.with_tensors(state.weights), every_row(rows))
    torch.testing.assert_close(state.best_error, torch.stack([errors[0, :30].mean(), errors[1, 30:].mean()]))
    assert state.history == []
    first = [w.clone() for w in state.best]
    state.epoch, state.best_error = 3, torch.tensor([0.0, 1e9])
    state.weights = [w + 0.1 for w in state.weights]
    _watch(state, layout, task, watch)
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
    assert told == [(k, 30, error) for k, error in zip(kept, state.history, strict=True)]
    assert state.epoch == min(30, int(state.best_epoch.max()) + 3)
    assert len(state.history) == state.epoch
    short = TrainingState.fresh(layout)
    gradient_fit(layout, rows, watched, TrainingConfig(epochs=2, patience=100, batch=64), short)
    assert (short.epoch, short.steps) == (2, 8)


def test_a_network_learns_what_it_is_shown():
    rows, layout = some_rows(n=300), Ensemble.fresh((3, 12, 2), 2, 1)
    config = TrainingConfig(epochs=60, patience=60, batch=50, learning_rate=0.02, weight_decay=0.0)
    ensemble = gradient_fit(layout, rows, torch.zeros(2, 6, dtype=torch.bool), config, TrainingState.fresh(layout))
    said = rows.scale * odd_output(ensemble, rows.x.double(), rows.parity.double()).mean(dim=0)
    assert float((said - rows.target).pow(2).mean() / rows.target.pow(2).mean()) < 0.12  # the scale is drawn anew in every row


def segment(tau, keep=None, cutoff=None, dt=0.01):
    keep = np.ones(len(tau), dtype=bool) if keep is None else keep
    return SimpleNamespace(tau=tau, keep=keep, low_pass=None if cutoff is None else LowPass(cutoff), dt=dt)


def test_the_torques_size_is_its_root_mean_square_over_all_rows_that_are_compared():
    rng = np.random.default_rng(1)
    parts = [rng.standard_normal((n, 2)) * [1.0, 5.0] for n in (50, 80, 30)]
    keep = np.arange(80) % 2 == 0
    segments = [segment(parts[0]), segment(parts[1], keep)], [segment(parts[2])]
    units = [SimpleNamespace(segments=lambda found=found: found) for found in segments]
    every = np.concatenate([parts[0], parts[1][keep], parts[2]])
    np.testing.assert_allclose(torque_rms(units), np.sqrt((every**2).mean(axis=0)), rtol=1e-6)
    with pytest.raises(CampaignError, match="long enough to train on"):
        torque_rms([SimpleNamespace(segments=tuple)])


@pytest.mark.parametrize(("cutoff", "dt", "stride"), [(None, 0.01, 1), (5.0, 0.01, 5), (2.5, 0.01, 10), (2.5, 0.02, 5), (50.0, 0.01, 1)])
def test_a_network_is_trained_on_four_rows_a_period_of_the_cut_off(cutoff, dt, stride):
    keep = np.arange(200) >= 20
    np.testing.assert_array_equal(row_numbers(segment(np.zeros((200, 1)), keep, cutoff, dt)), np.arange(20, 200, stride))


def test_inputs_get_unit_spread_odd_ones_about_zero_and_their_range_holds_the_mirror_images():
    generator = torch.Generator().manual_seed(1)
    x = torch.randn(20000, 4, generator=generator) * torch.tensor([2.0, 3.0, 0.5, 1.0]) + torch.tensor([0.7, 5.0, -1.0, 0.0])
    x[:, 3] = 4.0  # tells nothing
    rows = Rows(x.clone(), torch.tensor([-1.0, 1.0, -1.0, 1.0]), torch.ones(1), torch.ones(1), torch.zeros(1))
    centre, spread, lowest, highest = standardise(rows)
    mean = x.double().mean(dim=0)
    torch.testing.assert_close(centre, torch.tensor([0.0, mean[1], 0.0, 4.0], dtype=torch.float64))
    want = torch.stack([x[:, 0].double().pow(2).mean().sqrt(), x[:, 1].double().std(unbiased=False), x[:, 2].double().pow(2).mean().sqrt()])
    torch.testing.assert_close(spread[:3], want)
    assert float(spread[3]) == 1e6
    torch.testing.assert_close(rows.x, ((x - centre) / spread).float())
    reach = rows.x[:, [0, 2]].abs().amax(dim=0).double()
    torch.testing.assert_close(highest[[0, 2]], reach, rtol=1e-5, atol=1e-6)
    torch.testing.assert_close(lowest[[0, 2]], -reach, rtol=1e-5, atol=1e-6)
    ends = torch.stack([rows.x[:, 1].amin(), rows.x[:, 1].amax()]).double()
    torch.testing.assert_close(torch.stack([lowest[1], highest[1]]), ends, rtol=1e-5, atol=1e-6)


def test_each_member_watches_its_own_share_of_the_recordings():
    units = [SimpleNamespace(name=f"run{k}", group=f"run{k}", steady=False) for k in range(20)]
    watched = watched_units(units, TrainingConfig(members=5, validation_share=0.2, seed=3))
    assert watched.shape == (5, 20)
    assert watched.sum(dim=1).tolist() == [4] * 5
    assert len({tuple(row.tolist()) for row in watched}) > 1
    again = watched_units(units, TrainingConfig(members=4, validation_share=0.2, seed=4))
    assert torch.equal(again, watched[1:]), "member k of seed s is member k - 1 of seed s + 1"


def test_support_measures_the_distance_from_the_rows_in_units_of_two_hundred_of_its_mean():
    generator = torch.Generator().manual_seed(1)
    x = (torch.randn(5000, 3, generator=generator) * torch.tensor([1.0, 7.0, 0.2])).float()
    rows = Rows(x, torch.tensor([-1.0, 1.0, -1.0]), torch.ones(1), torch.ones(1), torch.zeros(1))
    R = support(rows)
    assert (R[1] == 0).all(), "even features have no distance"
    h = (x.double() @ R).pow(2).sum(dim=1)
    assert float(h.mean()) == pytest.approx(1 / 200, rel=1e-6)
    C = (x[:, [0, 2]].double().T @ x[:, [0, 2]].double()) / len(x)
    inverse = torch.linalg.inv(C + 1e-4 * torch.linalg.eigvalsh(C)[-1] * torch.eye(2))
    want = torch.einsum("ni,ij,nj->n", x[:, [0, 2]].double(), inverse, x[:, [0, 2]].double())
    torch.testing.assert_close(h / h.mean(), want / want.mean(), rtol=1e-4, atol=1e-6)


def test_the_factor_makes_nineteen_twentieths_of_the_rows_of_a_new_recording_lie_within():
    normal = NormalDist().inv_cdf
    two = np.concatenate([np.full(900, 1.0), np.full(10, 3.0)])
    units = np.where(two > 2, 2, np.arange(910) % 2)  # a hundredth of the rows, a third of the recordings
    assert _factor(two, units) == pytest.approx(3.0 / normal(0.975))


def test_conformal_intervals_cover_new_recordings_as_often_as_they_say():
    rng, covered = np.random.default_rng(1), []
    for _ in range(200):  # recordings differ in scale: rows of one recording say little about another
        scale = np.exp(0.7 * rng.standard_normal(31))
        ratio = scale[:, None] * np.abs(rng.standard_normal((31, 40)))
        q = conformal_quantile(ratio[:30].ravel(), np.repeat(np.arange(30), 40), 0.9)
        covered.append((ratio[30] <= q).mean())
    assert 0.88 < np.mean(covered) < 0.96
    few = conformal_quantile(np.arange(40.0), np.repeat([0, 1], 20), 0.95)
    assert few == pytest.approx(37.0, abs=1.1), "two recordings cannot promise 95 %: their own quantile"


def test_the_parts_of_the_variance_never_fall_below_nothing_and_a_silent_residual_has_hardly_any():
    rng = np.random.default_rng(1)
    s, S = rng.uniform(0.1, 1, 3000), rng.uniform(1, 3, 3000)
    found = _variance_terms(0.5 * s * rng.standard_normal(3000), s, S)
    assert (found >= 0).all()
    assert found[0] == pytest.approx(0.25, rel=0.15)
    assert found[1] * 4 < 0.02
    assert _variance_terms(np.zeros(100), s[:100], S[:100]).max() < 1e-20


def hybrid(members):
    """A model of which only corrections and familiarity are asked."""
    @dataclass(frozen=True)
    class Model:
        baseline: Any = "there"
        trust: Any = None
        doubt: Any = None

        def familiarity(self, x):
            return torch.full((len(x), 1), 0.8, dtype=torch.float64)

        def correction(self, x, scale, linear):
            return members(x)

    return Model()


def watched_rows(n=400, units=8, seed=1):
    rows = some_rows(n, units, seed=seed)
    return Rows(rows.x, rows.parity, rows.scale, rows.target, rows.unit, torch.zeros(n, 2, 2))


def test_a_correction_is_used_as_far_as_held_out_recordings_confirm_it():
    rows = watched_rows()
    target, unit = rows.target.double(), rows.unit
    for share, t in ((1.0, 1.0), (1 / 0.75, 0.75), (2.0, 0.5), (-1.0, 0.0), (30.0, 0.0)):
        b, trust = stack(target, {1.0: share * target}, unit)
        assert b == 1.0
        assert trust == pytest.approx(np.full(2, t))
    assert stack(target, {0.0: 0.5 * target, 1.0: target}, unit)[0] == 1.0
    assert stack(target, {1.0: 3.0 * target, 0.0: target}, unit)[0] == 0.0, "networks that only harm are left out"
    assert stack(target, {b: (0.5 - 0.001 * b) * target for b in NETWORKS}, unit, (1.0,))[0] == 1.0, "a hair does not tell against them"


def test_what_helps_many_and_ruins_one_recording_is_not_used():
    rows = watched_rows()
    target, unit = rows.target.double(), rows.unit
    ruinous = torch.where((unit == 3)[:, None], -4.0 * target, 0.4 * target)
    _, trust = stack(target, {1.0: ruinous}, unit)
    assert trust == pytest.approx(np.zeros(2))
    assert float((target - ruinous).abs().sum() / target.abs().sum()) < 1.3, "on average it hardly harms"


def test_rows_at_rest_say_nothing_and_a_recording_that_becomes_worse_weighs_by_how_many_times():
    target = torch.tensor([2.0, 2.0, 1.0, 1.0], dtype=torch.float64)[:, None]
    unit, correction = torch.tensor([0, 0, 1, 1]), torch.tensor([1.0, 1.0, -0.5, -0.5], dtype=torch.float64)[:, None]
    moving = losses(target, correction, unit, (1.0,))
    torch.testing.assert_close(moving[0, :, 0], torch.tensor([2.0 / 3.0, 3.0 / 3.0 + 2.0 * 0.5], dtype=torch.float64))
    resting = [torch.cat([x, 0 * x]) for x in (target, correction)]
    torch.testing.assert_close(losses(*resting, torch.cat([unit, unit]), (1.0,)), moving)


def test_where_no_recording_was_watched_trust_and_doubt_stay_as_they_are():
    rows, none = watched_rows(), torch.zeros(2, 8, dtype=torch.bool)
    model = hybrid(lambda x: torch.zeros(2, len(x), 2).double())
    assert with_trust(model, rows, none) is model
    assert with_std(model, rows, none) is model


def test_doubt_covers_the_residuals_of_watched_recordings_and_states_the_baselines_error_far_away():
    n = 4000
    rows = watched_rows(n)
    noise = torch.randn(n, 2, generator=torch.Generator().manual_seed(5)).double() * torch.tensor([0.3, 2.0])
    model = with_std(hybrid(lambda x: (rows.target.double() - noise).expand(2, -1, -1)), rows, torch.ones(2, 8, dtype=torch.bool))
    assert model.doubt.shape == (4, 2)
    u = (rows.target / rows.scale).double().pow(2).mean(dim=0).sqrt()
    torch.testing.assert_close(model.doubt[3], u)
    phi, zero = torch.full((n, 1), 0.8).double(), torch.zeros(n, 2).double()
    std = spread_of(model.doubt, zero, rows.scale.double(), phi)
    within = [(noise.abs() <= z * std).double().mean(dim=0) for z in (0.6745, 1.96)]
    wide = (noise.abs() <= std * 1.2816).double().mean(dim=0)
    assert float((wide - 0.8).abs().max()) < 0.2
    assert float(within[1].min()) > 0.9


def test_of_very_many_watched_rows_some_are_looked_at_evenly(monkeypatch):
    monkeypatch.setattr(doubt, "MOST", 10)
    mask = torch.zeros(100, dtype=torch.bool)
    mask[20:80] = True
    assert doubt.sample_rows(torch.arange(100), mask[None]).tolist() == list(range(20, 80, 7))
    monkeypatch.setattr(doubt, "MOST", 100)
    assert doubt.sample_rows(torch.arange(100), mask[None]).tolist() == list(range(20, 80))


def test_the_smallest_training_is_allowed():
    chosen = TrainingConfig(hidden=(1,), members=1, epochs=1, patience=1)
    assert chosen.hidden == (1,)
    assert TrainingConfig(hidden=(4096,)).hidden == (4096,)
    assert (TrainingConfig(cutoff_hz=0.5).cutoff_hz, TrainingConfig(bound=0.5).bound) == (0.5, 0.5)
    assert TrainingConfig(learning_rate=1.0).learning_rate == 1.0
    with pytest.raises(ValueError, match="learning_rate"):
        TrainingConfig(learning_rate=1.5)
    for name in ("cutoff_hz", "bound"):
        with pytest.raises(ValueError, match=name):
            TrainingConfig(**{name: 0.0})
    with pytest.raises(ValueError, match="1 to 4096 neurons"):
        TrainingConfig(hidden=(8, 4097))
    with pytest.raises(ValueError, match="1 to 4096 neurons"):
        TrainingConfig(hidden=(0,))
