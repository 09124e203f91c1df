"""A standard deviation is worth its name: it covers what it says, grows where nothing was shown, and survives storage."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import DEFAULT_LAWS, GIVEN, campaign, planted, recording, with_torque
from rigs import arm, states

from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.evaluation.model_errors import coverage_of
from nnhydro.fitting.network.predictive_std import _factor, _variance_terms
from nnhydro.fitting.network.train import train, train_units
from nnhydro.models.learned.learned import spread_of, view_of
from nnhydro.models.storage import load_model, save_model
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.splitting import units

FAST = DEFAULT_LAWS.model_copy(update={"hidden": (8,), "members": 4, "epochs": 6, "validation_share": 0.3})

KINDS = pytest.mark.parametrize("kind", ["network", pytest.param("hybrid", marks=pytest.mark.slow)])


def noisy(count=10, noise=0.05):
    """Recordings with friction that no baseline has and white noise."""
    a = arm(2)
    clean = campaign(a, planted(a), count, seconds=4.0, rate=25.0, noise=noise)
    return with_torque(clean, lambda name, tau: tau + 0.3 * np.tanh(4 * clean.load(name).qd))


@pytest.mark.parametrize("truth", [(4.0, 0.0, 0.01), (0.0, 0.09, 0.0), (1.0, 0.04, 0.01)])
def test_the_parts_of_the_variance_are_found(truth):
    rng = np.random.default_rng(1)
    s, S = rng.uniform(0.1, 1.0, 40_000), rng.uniform(0.5, 5.0, 40_000)
    variance = truth[0] * s**2 + truth[1] * S**2 + truth[2]
    found = _variance_terms(rng.standard_normal(40_000) * np.sqrt(variance), s, S)
    assert (found[0] * s**2 + found[1] * S**2 + found[2]) == pytest.approx(variance, rel=0.1)


def test_the_factor_makes_a_gaussian_cover_and_counts_recordings_alike():
    r = np.abs(np.random.default_rng(1).standard_normal(20_000))
    assert _factor(3 * r, np.zeros(20_000)) == pytest.approx(3.0, rel=0.02)
    unit = (np.arange(20_000) < 1000).astype(int)  # a short recording weighs as much as a long one
    ratio = np.where(unit == 1, 4 * r, r)
    assert _factor(ratio, unit) > _factor(ratio, np.zeros(20_000)) * 1.3


def test_the_spread_is_the_sum_of_its_parts():
    ones = torch.ones(3, 1, dtype=torch.float64)
    doubt = torch.tensor([[2.0], [0.5], [0.1], [3.0]], dtype=torch.float64)
    assert spread_of(doubt, 0.2 * ones, 4 * ones, ones) == pytest.approx(np.sqrt(0.16 + 4.0 + 0.01))
    assert spread_of(doubt, 0.2 * ones, 4 * ones, 0 * ones) == pytest.approx(np.sqrt(0.16 + 4.0 + 0.01 + 144.0))


@pytest.mark.slow
@KINDS
def test_held_out_torques_lie_within_the_intervals_as_often_as_said(kind):
    whole = noisy()
    result = BenchmarkOptions([kind], 3, config=FAST).benchmark(whole)
    shares = result.document()["models"][kind]["coverage"]["shares"]
    assert 0.40 < shares["50"] < 0.75
    assert 0.70 < shares["80"] < 0.95
    assert 0.87 < shares["95"] <= 1.0


@pytest.mark.slow
@KINDS
def test_intervals_are_wider_where_nothing_was_shown(kind):
    whole = noisy()
    model = train(whole, FAST.model_copy(update={"model": kind}))
    shown = Motion.of(whole.segments("run1", GIVEN)[0])
    faster = replace(shown, qd=6 * shown.qd, qdd=36 * shown.qdd, u0=6 * shown.u0)
    assert bool((model.std(faster).mean(0) > model.std(shown).mean(0)).all())
    assert float(model.excess(view(model, faster), model.standardised_features(view(model, faster))).median()) > 0.1
    strange = states(2, 50, seed=4, u0=6.0)
    assert float(model.excess(view(model, shown), model.standardised_features(view(model, shown))).max()) < 1e-6  # rows are float32
    assert float(model.excess(view(model, strange), model.standardised_features(view(model, strange))).min()) > 0


def view(model, motion):
    return view_of(model.arm, motion, model.floor)


@pytest.mark.slow
def test_intervals_of_a_withheld_speed_range_still_cover():
    a = arm(2)
    made = [recording(a, planted(a), f"run{i}", seed=i + 1, seconds=4.0, rate=25.0, speed=0.1 * i, noise=0.05) for i in range(9)]
    result = BenchmarkOptions(["hybrid"], config=FAST, protocol="leave-speed-range-out").benchmark(Campaign.of(a, made))
    assert result.document()["models"]["hybrid"]["coverage"]["shares"]["95"] > 0.85


@pytest.mark.slow
def test_doubt_survives_storage(tmp_path):
    model = train(noisy(6), FAST)
    again = load_model(save_model(model, tmp_path / "m"))
    motion = states(2, 20)
    assert torch.equal(again.doubt, model.doubt)
    assert torch.equal(again.support, model.support)
    assert torch.equal(again.std(motion), model.std(motion))


def test_a_single_recording_leaves_nothing_to_calibrate_on():
    whole = noisy(1)
    model = train_units(units(whole, GIVEN), whole.arm, GIVEN, FAST)
    assert model.doubt is None
    assert model.std(states(2, 5)) is not None
    assert coverage_of(model, units(whole, GIVEN)) is not None
