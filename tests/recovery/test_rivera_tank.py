"""On the tank whose water was computed by other code, the learned models beat the calibrated constants on motions not shown to them."""

from pathlib import Path

import pytest

from nnhydro.evaluation.entries import entries
from nnhydro.evaluation.metrics import Misfit
from nnhydro.evaluation.model_errors import misfit_of
from nnhydro.fitting.config import TrainingConfig
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.repeats import group_names
from nnhydro.recordings.splitting import folds, units

CAMPAIGN = Path(__file__).parents[2] / "datasets" / "rivera_tank"


@pytest.fixture
def shorter_memories(monkeypatch):
    """One memory of the strips is used instead of the mean of three, and each is trained in 70 passes instead of 90: they err more."""
    from nnhydro.fitting.network.strip_net import latest_nets, share

    fit = latest_nets.fit_strip_net
    monkeypatch.setattr(share, "NETS", 1)
    monkeypatch.setattr(latest_nets, "fit_strip_net", lambda runs, seed: fit(runs, seed, epochs=70))
    monkeypatch.setattr(latest_nets, "_LATEST", {})  # no other test gets such a net


@pytest.mark.slow(seconds=30)
@pytest.mark.usefixtures("shorter_memories")
def test_the_hybrid_is_twice_as_good_as_constants_and_the_network_four_times():
    campaign = open_campaign(CAMPAIGN)
    how = campaign.plan()
    every = units(campaign, how, 0, group_names(campaign))
    held_out = folds(every, 5, 0)[0]
    fitted = [unit for i, unit in enumerate(every) if i not in held_out][::3]  # a third of what there is to learn from is enough
    config = TrainingConfig(members=1, epochs=6)
    error = {}
    for entry in entries(("constant", "network", "hybrid"), campaign, config):
        model = entry.fit(fitted, campaign.arm, how, None)
        error[entry.name] = Misfit.total(misfit_of(model, every[i]) for i in held_out).error
    assert 0.1 < error["constant"] < 0.25
    assert error["hybrid"] < error["constant"] / 2
    assert error["network"] < error["constant"] / 4
