"""A correction is used as far as it exceeds what its members, each of whom has left out other motions, disagree about."""

from itertools import combinations

import numpy as np
import pytest
import torch
from campaigns import DEFAULT_LAWS, GIVEN, planted, sensor_torque
from rigs import arm

from nnhydro.fitting.network.rows import watched_units
from nnhydro.fitting.network.train import train
from nnhydro.models.learned.shrinkage import jackknife, shrink
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.recording import Recording
from nnhydro.recordings.splitting import units

SIX = DEFAULT_LAWS.model_copy(update={"members": 6, "epochs": 4, "validation_share": 0.34})
ONE = torch.ones(1, 1, dtype=torch.float64)


def used(*members):
    """The share of the members' mean that is used, of a single number each, N m."""
    all_of_them = torch.tensor(members, dtype=torch.float64)[:, None, None]
    return float(shrink(all_of_them.mean(dim=0), jackknife(all_of_them, 1 / 3), ONE) / all_of_them.mean())


def test_what_all_members_say_is_used_whole_and_what_they_quarrel_about_hardly():
    assert used(0.3) == pytest.approx(1.0)
    assert used(0.3, 0.3, 0.3) == pytest.approx(1.0)
    shares = [used(0.3 - d, 0.3, 0.3 + d) for d in (0.01, 0.1, 0.3, 1.0, 10.0)]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] > 0.99
    assert shares[-1] < 0.01


@pytest.mark.parametrize("away", [1, 2, 4])
def test_the_spread_is_the_jackknifes_for_a_mean_of_which_each_member_leaves_a_few_out(away):
    x = torch.from_numpy(np.random.default_rng(1).standard_normal(12))
    members = torch.stack([x[list(kept)].mean() for kept in combinations(range(12), 12 - away)])
    torch.testing.assert_close(jackknife(members[:, None, None], away / 12)[0, 0], x.var() / 12)


def test_the_correction_goes_smoothly_through_zero():
    m = torch.linspace(-1e-3, 1e-3, 2001, dtype=torch.float64)[:, None]
    c = shrink(m, 0.25 * m**2 + 1e-8, torch.ones_like(m))
    assert float(torch.diff(c[:, 0]).min()) > 0
    assert float(c.abs().max()) <= float(m.abs().max())


def swinging(hz, degrees, name):
    """An arm that swings at `hz`; its torques grow with its rates in a way that no coefficient of a baseline can follow."""
    a = arm(2)
    t = np.arange(200) / 50
    w, swing = 2 * np.pi * hz, np.radians(degrees) * np.array([1.0, 0.7])
    q, qd, qdd = (np.outer(wave, swing) for wave in (1 - np.cos(w * t), w * np.sin(w * t), w**2 * np.cos(w * t)))
    clean = sensor_torque(a, planted(a), Motion(tensor(t), tensor(q), tensor(qd), tensor(qdd), tensor(0 * t), tensor(0 * t)))
    noise = 0.02 * np.random.default_rng(int(100 * hz)).standard_normal(clean.shape)
    return Recording(name, t, q, clean * (1 + 0.3 * np.tanh(2 * np.abs(qd)) + noise), qd, qdd)


@pytest.fixture(scope="module")
def tank():
    """Slow and wide swings, a model trained on them, and two motions more: one like them, a quick and narrow one unlike any."""
    slow = [swinging(hz, degrees, f"slow_{hz}_{degrees}") for degrees in (20, 30, 40) for hz in (0.2, 0.28, 0.36)]
    new = Campaign.of(arm(2), [swinging(0.31, 33, "alike"), swinging(4.0, 1.5, "unlike")])
    shown = Campaign.of(arm(2), slow)
    return shown, new, train(shown, SIX)


def share_used(whole, model, name):
    motion = Motion.of(whole.segments(name, GIVEN)[0])
    base = model.baseline.torque(motion)
    return float((model.torque(motion) - base).abs().sum() / (model.members(motion).mean(dim=0) - base).abs().sum())


@pytest.mark.slow
def test_the_residual_fades_where_a_motion_leaves_what_was_trained(tank):
    _, new, model = tank
    near, far = share_used(new, model, "alike"), share_used(new, model, "unlike")
    assert near > 0.75
    assert far < 0.6


@pytest.mark.slow
def test_the_hybrid_gains_on_the_kind_that_was_trained_and_loses_nothing_on_another(tank):
    _, new, model = tank
    gained = {}
    for name in ("alike", "unlike"):
        segment = new.segments(name, GIVEN)[0]
        motion, tau = Motion.of(segment), tensor(segment.tau)
        gained[name] = float((tau - model.torque(motion)).abs().sum() / (tau - model.baseline.torque(motion)).abs().sum())
    assert gained["alike"] < 0.7, gained
    assert gained["unlike"] < 1.05, gained


@pytest.mark.slow
def test_of_six_members_every_recording_is_watched_in_both_orders(tank):
    shown, _, model = tank
    watched = watched_units(units(shown, GIVEN), SIX, model.arm)
    assert bool(watched[0::2].any(dim=0).all())
    assert bool(watched[1::2].any(dim=0).all())
    assert not bool(watched.all(dim=1).any())
