"""How much of a strip net a hybrid or network uses: what held-out recordings confirm, and nothing where they do not."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import DEFAULT_LAWS, GIVEN, campaign, planted
from rigs import arm, run

from nnhydro.fitting.network.strip_net import latest_nets, share
from nnhydro.fitting.network.strip_net.fit import fit_strip_net
from nnhydro.fitting.network.strip_net.share import SHARES, gains, share_of, thirds
from nnhydro.fitting.network.train import train
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.recordings.repeats import group_names
from nnhydro.recordings.splitting import units

FAST = DEFAULT_LAWS.model_copy(update={"members": 3, "epochs": 4, "validation_share": 0.34, "strip_net": True})


@pytest.fixture(scope="module", autouse=True)
def shorter_memories():
    """Memories of the strips are trained in 40 passes over the recordings instead of 90: they err more. Tests here share them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(latest_nets, "fit_strip_net", lambda runs, seed: fit_strip_net(runs, seed, epochs=40))
        patch.setattr(latest_nets, "_LATEST", {})
        yield


def gain_of(parts):
    """What is gained (shares, groups, 1) where a share t takes t g of 1 N m in each group."""
    return -(1 - SHARES[:, None, None] * torch.tensor(parts, dtype=torch.float64)[:, None]).log()


def test_a_gain_in_every_recording_is_used_whole():
    assert float(share_of(gain_of([0.3, 0.4, 0.5, 0.2]), 2 / 3)) == 1.0


def test_a_gain_that_one_recording_makes_is_left_alone():
    assert float(share_of(gain_of([0.9, -0.1, -0.1, -0.1, -0.1]), 2 / 3)) == 0.0
    assert float(share_of(gain_of([0.9, 0.7, 0.8, 0.7, -0.1]), 2 / 3)) == 1.0


def test_a_joint_that_gains_is_not_held_back_by_another():
    gain = torch.cat([gain_of([0.3, 0.4, 0.5]), gain_of([-0.3, -0.4, -0.5])], dim=2)
    assert share_of(gain, 2 / 3).tolist() == [1.0, 0.0]


def test_half_a_share_of_nets_of_two_thirds_is_more_of_a_net_of_all():
    gain = -(SHARES - 0.5).abs()[:, None, None].expand(-1, 4, 1)
    assert float(share_of(gain, 2 / 3)) == 0.5 / (0.5 + 0.5 * 2 / 3)


def test_every_group_is_left_out_once_and_whole():
    a = arm(2)
    whole = campaign(a, planted(a), 7, seconds=1.0, rate=25.0)
    chosen = units(whole, GIVEN, 0, group_names(whole))
    out = np.array(thirds(chosen, 0))
    assert out.shape == (3, 7)
    assert (out.sum(axis=0) == 1).all()
    assert sorted(out.sum(axis=1)) == [2, 2, 3]
    assert thirds(chosen[:2], 0) == []
    one = [unit.__class__(**{**unit.__dict__, "group": f"g{i // 2}"}) for i, unit in enumerate(chosen[:6])]
    assert all(x[0] == x[1] and x[2] == x[3] for x in thirds(one, 0))


def test_where_the_baseline_is_right_no_net_is_kept_and_the_hybrid_is_the_one_without():
    a = arm(2)
    whole = campaign(a, planted(a), 9, seconds=2.0, rate=25.0, noise=0.1)
    with_it, without = (train(whole, FAST.model_copy(update={"strip_net": on})) for on in (True, False))
    assert with_it.water is None
    assert torch.equal(with_it.torque(run(2)), without.torque(run(2)))
    assert torch.equal(with_it.std(run(2)), without.std(run(2)))


def test_where_a_net_gains_nothing_no_other_is_trained(monkeypatch):
    trained = []

    def worthless(runs, seed):
        trained.append(seed)
        net = fit_strip_net(runs, seed, epochs=1)
        return replace(net, out=100 + 0 * net.out)

    a = arm(2)
    monkeypatch.setattr(share, "trained_net", worthless)
    assert train(campaign(a, planted(a), 6, seconds=2.0, rate=25.0, noise=0.1), FAST).water is None
    assert len(trained) == 1


def test_what_a_net_gains_on_a_group_is_the_logarithm_of_how_many_times_less_is_left():
    r, apart = torch.tensor([[[1.0], [-2.0], [4.0]], [[1.0], [0.0], [8.0]]], dtype=torch.float64)
    gain = gains(r, apart, torch.tensor([3, 5, 3]))
    assert gain.shape == (len(SHARES), 2, 1)
    want = torch.tensor([[1.0, 1.0], [10.0, 1.0], [1.25, 1.0]], dtype=torch.float64).log()
    torch.testing.assert_close(gain[[0, 5, 10], :, 0], want)


@pytest.mark.parametrize("size", [1.0, 100.0])
def test_recordings_of_large_torques_do_not_outvote_others(size):
    r = torch.tensor([size] * 3 + [1.0] * 5, dtype=torch.float64)[:, None]
    apart = torch.tensor([size / 2] * 3 + [-1.0] * 5, dtype=torch.float64)[:, None]  # three are halved, five doubled
    assert float(share_of(gains(r, apart, torch.arange(8)), 2 / 3)) == 0.0


@pytest.mark.parametrize("kind", ["hybrid", "network"])
def test_what_the_net_gains_on_held_out_recordings_is_used(kind):
    a = arm(2)
    whole = campaign(a, state_loads(a), 9, seconds=2.5, rate=40.0)
    poor = FAST.model_copy(update={"law": (), "features": ("rates",), "free": False, "baseline": "drag-only", "model": kind})
    model = train(whole, poor)
    assert model.share is not None
    assert float(model.share.min()) > 0.2
    assert model.water is not None


@pytest.mark.parametrize(("kind", "held"), [("hybrid", False), ("network", True)])
def test_where_no_motion_is_familiar_a_net_gains_a_hybrid_nothing_and_a_network_as_much(kind, held, monkeypatch):
    monkeypatch.setattr(LearnedTorque, "familiarity", lambda model, x: 0 * x[:, :1])
    poor = FAST.model_copy(update={"law": (), "features": ("rates",), "free": False, "baseline": "drag-only", "model": kind})
    model = train(campaign(arm(2), state_loads(arm(2)), 9, seconds=2.5, rate=40.0), poor)
    assert (model.water is not None) == held
