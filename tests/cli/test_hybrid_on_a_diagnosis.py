"""A hybrid may stand on the model that a diagnosis wrote, and takes over what the diagnosis found."""

import pytest
import torch
from rigs import run as motion

from nnhydro.blind_tests.conceal import conceal
from nnhydro.blind_tests.truth.campaign import Wish
from nnhydro.cli.main import run
from nnhydro.models.storage import load_model


@pytest.mark.slow
def test_a_diagnosed_model_is_the_baseline_of_a_hybrid(tmp_path, capsys):
    conceal(tmp_path / "suite", [Wish("umbilical_stiffness", "strong", 1, 1, "small")], seed=3)
    campaign = str(tmp_path / "suite" / "campaign_000")
    assert run(["diagnose", campaign, "--out", str(tmp_path / "found"), "--quiet"]) == 0
    diagnosed = tmp_path / "found" / "model"
    config = tmp_path / "hybrid.toml"
    config.write_text(f"baseline = '{diagnosed}'\nhidden = [8]\nmembers = 2\nepochs = 2\n")
    assert run(["train", campaign, "--config", str(config), "--out", str(tmp_path / "hybrid"), "--quiet"]) == 0
    capsys.readouterr()
    hybrid, found = load_model(tmp_path / "hybrid"), load_model(diagnosed)
    states = motion(hybrid.arm.n_links)
    assert torch.equal(hybrid.baseline.torque(states), found.torque(states))
    plain = load_model(tmp_path / "found" / "baseline")
    assert float((found.torque(states) - plain.torque(states)).abs().max()) > 0.01  # the hose is part of the hybrid
    assert bool(hybrid.torque(states).isfinite().all())
