"""`nnhydro diagnose` on a folder of campaigns: one that cannot be read stops no other, and a hybrid may stand on what was found."""

import io
import json
from contextlib import redirect_stderr

import pytest
import torch
from rigs import run as motion

from nnhydro.blind_tests.conceal import conceal
from nnhydro.blind_tests.truth import campaign
from nnhydro.blind_tests.truth.campaign import Wish
from nnhydro.cli.main import run
from nnhydro.models.storage import load_model

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    """Two campaigns that hide a hose; the second is broken."""
    folder = tmp_path_factory.mktemp("many") / "suite"
    with pytest.MonkeyPatch.context() as patch:  # drawn without its rivals, which take two thirds of the time
        patch.setattr(campaign, "nearest", lambda rng, reference, found: [{} for _ in found])
        conceal(folder, [Wish("umbilical_stiffness", "strong", 1, 1, "small")] * 2, seed=3)
    next((folder / "campaign_001" / "recordings").iterdir()).write_text("t_s,q1_rad\n0.0,broken\n")
    return folder


@pytest.fixture(scope="module")
def diagnosed(suite, tmp_path_factory):
    """The folder of the diagnoses, the exit code and the error."""
    out, error = tmp_path_factory.mktemp("diagnosed") / "out", io.StringIO()
    with redirect_stderr(error):
        code = run(["diagnose", str(suite), "--out", str(out), "--jobs", "2"])
    return out, code, error.getvalue()


def test_every_campaign_of_a_folder_is_diagnosed_and_the_broken_one_named(diagnosed):
    out, code, error = diagnosed
    assert code == 2
    assert "1 of 2 campaigns could not be diagnosed" in error
    assert "campaign_001" in error
    assert json.loads((out / "campaign_000" / "diagnosis.json").read_text())["schema"] == "nnhydro/diagnosis/1"
    assert not (out / "campaign_001").exists()


def test_a_diagnosed_model_is_the_baseline_of_a_hybrid(suite, diagnosed, tmp_path):
    folder = diagnosed[0] / "campaign_000"
    config = tmp_path / "hybrid.toml"
    config.write_text(f"baseline = '{folder / 'model'}'\nhidden = [8]\nmembers = 2\nepochs = 2\n")
    assert run(["train", str(suite / "campaign_000"), "--config", str(config), "--out", str(tmp_path / "hybrid"), "--quiet"]) == 0
    hybrid, found = load_model(tmp_path / "hybrid"), load_model(folder / "model")
    states = motion(hybrid.arm.n_links)
    assert torch.equal(hybrid.baseline.torque(states), found.torque(states))
    plain = load_model(folder / "baseline")
    assert float((found.torque(states) - plain.torque(states)).abs().max()) > 0.01  # the hose is part of the hybrid
    assert bool(hybrid.torque(states).isfinite().all())
