"""A network and a hybrid of the same recordings share their nets; other recordings, or another seed, do not."""

from dataclasses import replace

import pytest
from campaigns import DEFAULT_LAWS, GIVEN, campaign
from rigs import arm

from nnhydro.fitting.network.strip_net import latest_nets
from nnhydro.fitting.network.strip_net.latest_nets import MOST, trained_net
from nnhydro.fitting.network.strip_net.rows import runs_of
from nnhydro.fitting.network.train import train
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.recordings.splitting import units

POOR = DEFAULT_LAWS.model_copy(update={"members": 3, "epochs": 4, "validation_share": 0.34, "strip_net": True, "law": (),
                                       "features": ("rates",), "free": False, "baseline": "drag-only"})


@pytest.fixture
def trained(monkeypatch):
    """The seeds of the nets that are trained, nothing of them known at first."""
    seeds, fit = [], latest_nets.fit_strip_net
    monkeypatch.setattr(latest_nets, "_LATEST", {})
    monkeypatch.setattr(latest_nets, "fit_strip_net", lambda runs, seed: seeds.append(seed) or fit(runs, seed, epochs=2))
    return seeds


def test_a_network_and_a_hybrid_of_the_same_recordings_train_their_nets_once(trained):
    whole = campaign(arm(2), state_loads(arm(2)), 9, seconds=2.5, rate=40.0)
    for kind in ("network", "hybrid"):
        train(whole, POOR.model_copy(update={"model": kind}))
    assert len(trained) == len(set(trained)) <= MOST


def test_what_a_net_is_trained_on_tells_it_apart_and_only_the_last_are_known(trained):
    a = arm(2)
    runs = runs_of(units(campaign(a, state_loads(a), 3, seconds=2.0, rate=25.0), GIVEN), a)
    first = trained_net(runs, 0)
    assert trained_net([replace(run, unit=run.unit + 5) for run in runs], 0) is first
    assert trained_net(runs[:2], 0) is not first
    changed = replace(runs[0], left=runs[0].left + 1e-6)
    assert trained_net([changed, *runs[1:]], 0) is not first
    for seed in range(1, MOST):
        trained_net(runs, seed)
    assert trained == [0, 0, 0, 1, 2, 3, 4, 5]
    trained_net(runs, 0)
    assert len(trained) == 9, "the first was trained longest ago"
