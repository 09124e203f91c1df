"""Campaigns from a folder or from data frames, or one line that says what is wrong."""

import numpy as np
import pandas as pd
import pytest
from campaigns import columns_of, planted, recording, write_folder
from rigs import arm

import nnhydro


def test_a_folder_stands_for_its_campaign_and_anything_else_is_refused_in_one_line(tmp_path, healthy, fitted):
    folder = write_folder(healthy, tmp_path / "tank")
    looked = nnhydro.check(nnhydro.load(folder)).to_frame()
    for given in (folder, str(folder)):
        assert nnhydro.check(given).to_frame().equals(looked)
    assert nnhydro.identify(str(folder), "constant").to_frame().equals(nnhydro.identify(nnhydro.load(folder), "constant").to_frame())
    compared = nnhydro.benchmark(folder, ["textbook"], folds=2).to_frame()
    assert compared["error"].tolist() == nnhydro.benchmark([folder], ["textbook"], folds=2).to_frame()["error"].tolist()
    wrong = {"a frame": pd.DataFrame(), "nothing": None, "a number": 3.0}
    for call in (nnhydro.check, nnhydro.identify, nnhydro.train, nnhydro.benchmark, nnhydro.diagnose):
        for given in wrong.values():
            with pytest.raises(nnhydro.NnhydroError, match=r"campaign: got \w+: give a folder"):
                call(given)
    with pytest.raises(nnhydro.NnhydroError, match="nowhere: "):
        nnhydro.diagnose(tmp_path / "nowhere")


def test_a_frame_becomes_a_recording_or_says_which_column_is_missing(healthy):
    run = recording(arm(), planted(arm()), seconds=1.0)
    frame = pd.DataFrame(columns_of(run)).assign(comment="kept out")
    read = nnhydro.read_frame(frame, arm(), "run9")
    np.testing.assert_array_equal(read.tau, run.tau)
    assert read.name == "run9"
    with pytest.raises(nnhydro.NnhydroError, match="column 'q2_rad' is missing"):
        nnhydro.read_frame(frame.drop(columns="q2_rad"), arm())


def test_a_campaign_is_loaded_whole_or_refused_with_one_line(healthy, tmp_path):
    folder = write_folder(healthy, tmp_path / "c")
    loaded = nnhydro.load(folder)
    assert loaded.names == healthy.names
    assert "2 links, 4 recordings (run0, run1, run2, ...)" in repr(loaded)
    (folder / "recordings" / "run3.csv").write_text("t_s\n")
    with pytest.raises(nnhydro.NnhydroError, match=r"run3\.csv"):
        nnhydro.load(folder)
    with pytest.raises(nnhydro.NnhydroError, match="does not exist"):
        nnhydro.load(tmp_path / "nowhere")
