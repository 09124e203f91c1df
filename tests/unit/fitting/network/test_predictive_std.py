"""A standard deviation is worth its name: it covers what it says, grows where nothing was shown, and survives storage."""

from dataclasses import dataclass, field, replace
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
import torch
from campaigns import DEFAULT_LAWS, GIVEN, campaign, planted, recording, with_torque
from rigs import arm, states
from training_rows import watched_rows

from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.evaluation.model_errors import coverage_of
from nnhydro.fitting.network import predictive_std as doubt
from nnhydro.fitting.network.predictive_std import _factor, _variance_terms, conformal_quantile, support, with_std, with_trust
from nnhydro.fitting.network.rows import Rows
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
        fit: Any = field(default_factory=dict)

        def familiarity(self, x):
            return torch.full((len(x), 1), 0.8, dtype=torch.float64)

        def correction(self, x, scale, linear):
            return members(x)

    return Model()


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


@dataclass(frozen=True)
class Distant:
    """What caution changes of a model."""

    fit: dict[str, float]
    support: torch.Tensor | None


def test_a_tenth_of_the_caution_is_a_tenth_of_the_squared_distance():
    x = torch.randn(5, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(1))
    model = Distant({"left_out": 0.2}, torch.eye(3, dtype=torch.float64))
    careless = doubt._with_caution(model, 0.1)
    torch.testing.assert_close((x @ careless.support).pow(2).sum(dim=1), 0.1 * x.pow(2).sum(dim=1))
    assert careless.fit == {"left_out": 0.2, "caution": 0.1}
    assert doubt._with_caution(replace(model, support=None), 0.1).support is None


def test_of_very_many_watched_rows_some_are_looked_at_evenly(monkeypatch):
    monkeypatch.setattr(doubt, "MOST", 10)
    mask = torch.zeros(100, dtype=torch.bool)
    mask[20:80] = True
    assert doubt.sample_rows(torch.arange(100), mask[None]).tolist() == list(range(20, 80, 7))
    monkeypatch.setattr(doubt, "MOST", 100)
    assert doubt.sample_rows(torch.arange(100), mask[None]).tolist() == list(range(20, 80))
