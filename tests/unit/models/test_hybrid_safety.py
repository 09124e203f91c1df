"""A hybrid is never much worse than its baseline: where there is nothing to learn, and where there are no data."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import DEFAULT_LAWS, GIVEN, campaign, planted, recording, with_torque
from rigs import arm, mirrored_about_Y, run, states

from nnhydro.errors import CampaignError
from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.evaluation.protocols.protocol import protocols
from nnhydro.fitting.identify import identify
from nnhydro.fitting.network.train import train
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.learned.learned import view_of
from nnhydro.models.storage import load_model, save_model
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.splitting import units

FAST = DEFAULT_LAWS.model_copy(update={"members": 3, "epochs": 6, "validation_share": 0.25})
NEVER_WORSE = 1.05


def frictional(count=6):
    a = arm(2)
    clean = campaign(a, planted(a), count, seconds=2.0, rate=25.0, noise=0.02)
    return with_torque(clean, lambda name, tau: tau + 0.3 * np.tanh(4 * clean.load(name).qd))


def towed(noise=0.1, count=8):
    """Recordings in which nothing but noise is left to learn beyond the constant baseline."""
    a = arm(2)
    return Campaign.of(a, [recording(a, planted(a), f"run{i}", seed=i + 1, seconds=4.0, rate=25.0, speed=0.1 * i, noise=noise)
                           for i in range(count)])


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(protocols()) - {"leave-arm-out"}))
def test_where_the_baseline_is_right_the_hybrid_keeps_to_it(name):
    result = BenchmarkOptions(["constant", "hybrid"], 2, config=FAST, protocol=name).benchmark(towed())
    for number in range(len(result.folds)):
        errors = result.fold_errors(number)
        assert errors["hybrid"] <= NEVER_WORSE * errors["constant"]


@pytest.mark.slow
def test_the_residual_fades_far_from_the_recordings():
    whole = frictional()
    model = train(whole, FAST)
    shown = Motion.of(whole.segments("run1", GIVEN)[0])
    faint = replace(model, support=1000 * model.support)  # as if every state were a thousand times as far
    assert float((faint.torque(shown) - faint.baseline.torque(shown)).abs().max()) < 1e-3 * float(model.torque(shown).abs().max())
    assert float((model.torque(shown) - model.baseline.torque(shown)).abs().mean()) > 0.05


@pytest.mark.slow
def test_a_joint_that_never_moved_is_unfamiliar_when_it_moves():
    a = arm(2)
    made = []
    for i in range(5):
        r = recording(a, planted(a), f"run{i}", seed=i + 1, seconds=3.0, rate=25.0, speed=0.1 * i)
        locked = {"q": r.q * [1, 0], "qd": r.qd * [1, 0], "qdd": r.qdd * [1, 0]}
        made.append(replace(r, **locked))
    model = train(Campaign.of(a, made), FAST)

    def phi(motion):
        return float(model.familiarity(model.standardised_features(view_of(model.arm, motion, model.floor))).median())

    assert phi(Motion.of(next(iter(units(Campaign.of(a, made), GIVEN))).segments()[0])) > 0.95
    assert phi(states(2, 200, seed=3)) < 0.2


@pytest.mark.slow
def test_fading_keeps_the_mirror_symmetry_and_the_rest():
    model = train(frictional(), FAST)
    motion = run(2)
    torch.testing.assert_close(model.torque(mirrored_about_Y(motion)), -model.torque(motion), rtol=1e-9, atol=1e-9)
    still = Motion.at(np.random.default_rng(1).uniform(-3, 3, (10, 2)), 0.0, 0.0)
    assert float(model.torque(still).abs().max()) < 1e-12
    assert bool(torch.isfinite(model.std(still)).all())


def corrected(whole):
    """A simulation with friction added to it, as a diagnosis writes it."""
    before = identify(whole, "constant")
    after = replace(before, loads=before.loads.plus("friction", ViscousTerm((0.4, 0.1))))
    return CorrectedSimulation(before.arm, before.preparation, before.fit, before, before, after)


MODELS = {"physics": lambda whole: identify(whole, "constant"), "diagnosed": corrected,
          "learned": lambda whole: train(whole, FAST.model_copy(update={"model": "network"}))}


@pytest.mark.slow
@pytest.mark.parametrize("inner", MODELS)
def test_the_baseline_may_be_any_stored_model(inner, tmp_path):
    first = MODELS[inner](frictional(4))
    folder = save_model(first, tmp_path / "first")
    model = train(frictional(), FAST.model_validate({**FAST.model_dump(), "baseline": str(folder)}))
    again = load_model(save_model(model, tmp_path / "second"))
    motion = run(2)
    assert torch.equal(model.baseline.torque(motion), first.torque(motion))
    torch.testing.assert_close(again.torque(motion), model.torque(motion), rtol=1e-12, atol=1e-12)  # tensors lie elsewhere in memory


def test_a_baseline_that_saw_the_campaign_is_refused_in_a_benchmark(tmp_path):
    whole = frictional()
    folder = save_model(identify(whole, "constant"), tmp_path / "seen")
    config = FAST.model_validate({**FAST.model_dump(), "baseline": str(folder)})
    with pytest.raises(CampaignError, match="hybrid: has seen"):
        BenchmarkOptions(["hybrid"], 2, config=config).benchmark(whole)


@pytest.mark.slow(seconds=25)
def test_on_the_demo_campaign_the_hybrid_is_never_worse_under_any_protocol():
    from nnhydro.demo import CAMPAIGN
    from nnhydro.recordings.campaign import open_campaign

    shipped = open_campaign(CAMPAIGN)
    every_third = list(shipped.recordings())[::3]
    whole = Campaign.of(shipped.arm, [r.rows(slice(None, None, 9), "every ninth row") for r in every_third])
    config = DEFAULT_LAWS.model_copy(update={"hidden": (16,), "members": 2, "epochs": 6})
    own_folds = set(protocols()) - {"leave-arm-out", "learning-curve"}  # of so few recordings the curve is a fold of leave-recordings-out
    for name in sorted(own_folds):
        result = BenchmarkOptions(["constant", "hybrid"], 2, config=config, protocol=name).benchmark(whole)
        for number in range(len(result.folds)):
            errors = result.fold_errors(number)
            assert errors["hybrid"] <= NEVER_WORSE * errors["constant"], (name, number, errors)
