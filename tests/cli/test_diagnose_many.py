"""`nnhydro diagnose` on a folder of campaigns: each to its own folder, and one that cannot be read stops no other."""

import json

import pytest

from nnhydro.blind_tests.conceal import conceal
from nnhydro.blind_tests.truth.campaign import Wish
from nnhydro.cli.main import run


@pytest.mark.slow
def test_every_campaign_of_a_folder_is_diagnosed_and_the_broken_one_named(tmp_path, capsys):
    suite, out = tmp_path / "suite", tmp_path / "out"
    conceal(suite, [Wish("umbilical_stiffness", "strong", 1, 1, "small")] * 2, seed=3)
    broken = suite / "campaign_001" / "recordings"
    next(broken.iterdir()).write_text("t_s,q1_rad\n0.0,broken\n")
    assert run(["diagnose", str(suite), "--out", str(out), "--jobs", "2"]) == 2
    error = capsys.readouterr().err
    assert "1 of 2 campaigns could not be diagnosed" in error
    assert "campaign_001" in error
    assert json.loads((out / "campaign_000" / "diagnosis.json").read_text())["schema"] == "nnhydro/diagnosis/1"
    assert not (out / "campaign_001").exists()
