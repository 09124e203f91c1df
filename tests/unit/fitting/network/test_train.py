"""A training can be repeated, stopped and resumed bit for bit, and it never sees what it must not see."""

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import torch
from campaigns import GIVEN, TINY, campaign, planted, same_tensors, steady_table, with_torque
from rigs import arm, run

from nnhydro.errors import CampaignError, ModelError
from nnhydro.evaluation.metrics import Misfit
from nnhydro.evaluation.model_errors import misfit_of
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import calibrate
from nnhydro.fitting.network.gradient_fit import TrainingState, gradient_fit
from nnhydro.fitting.network.rows import torque_rms, training_rows, watched_units
from nnhydro.fitting.network.train import train, train_units
from nnhydro.models.baselines import baseline
from nnhydro.models.learned.network import Ensemble
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import plan
from nnhydro.recordings.splitting import folds, units

KINDS = pytest.mark.parametrize("kind", ["network", "hybrid"])


@cache
def small(noise=0.02, count=6):
    return campaign(arm(2), planted(arm(2)), count, noise=noise, seconds=2.0, rate=50.0)


def tiny(**changes):
    return TINY.model_copy(update=changes)


@cache
def uninterrupted(kind, layers):
    return train(small(), tiny(model=kind, epochs=5, layers=layers))


@pytest.mark.slow
@KINDS
def test_the_same_seed_gives_the_same_model_and_another_seed_another(kind):
    one, again, other = (train(small(), tiny(model=kind, seed=seed)) for seed in (1, 1, 2))
    assert same_tensors(one, again)
    assert one.fit["validation_error"] == again.fit["validation_error"]
    assert not same_tensors(one, other)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "layers", "stop"), [
    ("hybrid", "common", 1), ("network", "parallel", 3), ("hybrid", "parallel", 3), ("network", "common", 1), ("hybrid", "common", 3),
    ("network", "common", 3), ("hybrid", "parallel", 1), ("network", "parallel", 1)])
def test_a_training_that_was_stopped_and_resumed_is_the_uninterrupted_one(kind, stop, layers, tmp_path):
    config, checkpoint = tiny(model=kind, epochs=5, layers=layers), tmp_path / "state.safetensors"

    def interrupt(epoch, epochs, error):
        if epoch == stop:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(small(), config, checkpoint, interrupt)
    seen = []
    resumed = train(small(), config, checkpoint, lambda epoch, epochs, error: seen.append(epoch))
    assert seen == list(range(stop + 1, 6))
    whole = uninterrupted(kind, layers)
    assert same_tensors(resumed, whole)
    assert resumed.fit["validation_error"] == whole.fit["validation_error"]
    assert resumed.fit["best_epoch"] == whole.fit["best_epoch"]


def test_a_checkpoint_that_is_damaged_is_refused_in_one_line(tmp_path):
    checkpoint = tmp_path / "state.safetensors"
    checkpoint.write_bytes(b"\x80\x04 no tensors here")
    with pytest.raises(ModelError, match="without --resume"):
        train(small(), tiny(), checkpoint)


def rows_and_watch(whole, config):
    chosen = units(whole, GIVEN)
    rows = training_rows(chosen, whole.arm, config, 0.1 * torque_rms(chosen), None)
    return rows, watched_units(chosen, config)


def fit(rows, watched, config, state=None):
    layout = Ensemble.fresh((rows.x.shape[1], *config.hidden, 2), config.members, config.seed)
    state = state or TrainingState.fresh(layout)
    return gradient_fit(layout, rows, watched, config, state), state


def test_a_member_does_not_learn_from_what_it_watches():
    config = tiny(members=3, epochs=1, validation_share=0.3)
    rows, watched = rows_and_watch(small(), config)
    _, state = fit(rows, watched, config)
    for member in range(3):
        hidden = watched[member][rows.unit]
        assert 0 < hidden.sum() < len(hidden)
        lied_to = replace(rows, target=torch.where(hidden[:, None], -rows.target, rows.target))  # the rms stays what it was
        _, other = fit(lied_to, watched, config)
        assert all(torch.equal(a[member], b[member]) for a, b in zip(state.weights, other.weights, strict=True))
        assert not torch.equal(state.best_error[member], other.best_error[member])
        others = [k for k in range(3) if not torch.equal(watched[k], watched[member])]
        assert others
        assert not any(torch.equal(state.weights[0][k], other.weights[0][k]) for k in others)


def test_members_watch_different_recordings():
    assert len({tuple(row.tolist()) for row in rows_and_watch(small(), tiny(members=4))[1]}) > 1


def test_the_best_weights_are_kept_not_the_last():
    config = tiny(epochs=30, learning_rate=0.1, members=2)
    rows, watched = rows_and_watch(small(), config)
    layout = Ensemble.fresh((rows.x.shape[1], *config.hidden, 2), 2, 0)
    best, states = [], [layout.tensors()]  # those before the first epoch are a candidate too
    state = TrainingState.fresh(layout)

    def note(state):
        best.append(state.best_error.clone())
        states.append([w.clone() for w in state.weights])

    model = gradient_fit(layout, rows, watched, config, state, note)
    for member in range(2):
        epoch = int(state.best_epoch[member])
        assert all(torch.equal(w[member], kept[member]) for w, kept in zip(state.best, states[epoch], strict=True))
    assert all(torch.equal(w, kept.double()) for w, kept in zip(model.weights[:-1], state.best, strict=False))
    assert bool(((state.best_epoch > 0) & (state.best_epoch < 30)).any())  # at such a rate the last epoch is not the best of all
    assert all(bool((b <= a).all()) for a, b in pairwise(best))


def test_training_stops_when_nobody_has_improved_for_the_patience():
    config = tiny(epochs=200, learning_rate=1.0, patience=3)
    rows, watched = rows_and_watch(small(), config)
    _, state = fit(rows, watched, config)
    assert state.epoch < 200
    assert state.epoch == int(state.best_epoch.max()) + 3


@pytest.mark.slow
@KINDS
def test_a_folds_model_knows_nothing_of_the_torques_that_are_held_out(kind):
    whole = small()
    split = folds(units(whole, GIVEN), 3)
    hidden = {whole.names[i] for i in split[0]}
    wild = with_torque(whole, lambda name, tau: 100 * tau[::-1] + 7 if name in hidden else tau)

    def fold(c):
        how = c.plan()
        return train_units([u for i, u in enumerate(units(c, how)) if i not in split[0]], c.arm, how, tiny(model=kind))

    assert whole.plan() == wild.plan()
    assert same_tensors(fold(whole), fold(wild))


def test_the_cutoff_does_not_depend_on_any_torque():
    whole = Campaign.of(arm(2), [replace(r, qd=None, qdd=None) for r in small().recordings()])
    assert plan(whole.recordings()) == plan(with_torque(whole, lambda name, tau: 50 * tau**3).recordings())


@pytest.mark.parametrize("kind", ["network", "hybrid"])
def test_a_law_that_no_baseline_has_is_learned(kind):
    a = arm(1)
    clean = campaign(a, planted(a).plus("friction", ViscousTerm((0.3,))), 6, seconds=3.0, rate=50.0)
    whole = with_torque(clean, lambda name, tau: tau + 0.5 * np.tanh(5 * clean.load(name).qd))
    how = whole.plan()
    all_units = units(whole, how)
    fitted, held_out = all_units[:4], all_units[4:]
    config = tiny(model=kind, epochs=60, learning_rate=0.02, hidden=(16,), members=1, features=("morison", "groups", "rates", "angles"))
    model = train_units(fitted, a, how, config)
    constant = calibrate(baseline("constant"), fitted, a, how)
    errors = [Misfit.total(misfit_of(m, u) for u in held_out).error for m in (model, constant)]
    assert errors[0] < 0.7 * errors[1]


@pytest.mark.parametrize("density", [0.0, 1000.0])
@pytest.mark.parametrize("links", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
def test_arms_of_any_size_wet_or_dry_are_trained_to_finite_models(links, density):
    a = arm(links, density)
    whole = campaign(a, planted(a), 3, seconds=1.0, rate=50.0)
    model = train(whole, tiny(epochs=2))
    assert model.baseline.name == ("rigid" if density == 0 else "constant")
    assert all(bool(torch.isfinite(x).all()) for x in model.arrays().values())


def test_steady_tables_alone_can_be_learned_from():
    a = arm(2)
    model = train(Campaign.of(a, [], (steady_table(a, planted(a)),)), tiny(epochs=2))
    assert all(math.isfinite(e) for e in model.fit["validation_error"])


def test_the_record_says_what_was_trained_on():
    whole = small()
    record = train(whole, tiny()).fit
    assert record["recordings"] == list(whole.names)
    assert record["campaign_sha256"] == whole.sha256()
    assert TrainingConfig.model_validate(record["config"]) == tiny()


def test_a_campaign_without_a_finite_row_cannot_be_trained_on():
    with pytest.raises(CampaignError, match="nnhydro check"):
        train(with_torque(small(), lambda name, tau: tau * np.nan), tiny(model="network"))


@pytest.mark.parametrize("layers", ["common", "parallel"])
@pytest.mark.parametrize("features", [("raw",), ("dimensional", "travel", "low-pass"), ("groups", "morison")], ids=lambda names: names[0])
def test_every_architecture_is_trained_on_every_kind_of_input(features, layers):
    stiffer = with_torque(small(count=3), lambda name, tau: 1.5 * tau)  # something that the baseline leaves
    model = train(stiffer, tiny(features=features, layers=layers, hidden=(6, 4, 3), law=(), bound=100.0))
    assert (model.ensemble.hidden, model.ensemble.members) == ((6, 4, 3), 2)
    assert len(model.ensemble.weights[0]) == (4 if layers == "parallel" else 2)
    assert bool(torch.isfinite(model.torque(run(2))).all())
    assert not torch.equal(model.torque(run(2)), model.baseline.torque(run(2)))
