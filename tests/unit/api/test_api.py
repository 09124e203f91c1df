"""The public interface: results that show themselves, turn into frames and agree with what the command line writes."""

import json
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from campaigns import TINY, angles_only, campaign, columns_of, planted, recording, write_folder
from rigs import arm

import nnhydro
from nnhydro.sheet import Column, Sheet, percent


class Balanced(HTMLParser):
    """Refuses HTML whose tags do not close in order."""

    def __init__(self):
        super().__init__()
        self.open, self.text = [], ""

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def text_of(html):
    """The words of the page, after checking that its tags close."""
    parser = Balanced()
    parser.feed(html)
    assert not parser.open
    return parser.text


@pytest.fixture(scope="module")
def healthy():
    a = arm()
    return campaign(a, planted(a), count=4, noise=0.01)


@pytest.fixture(scope="module")
def fitted(healthy):
    return nnhydro.identify(healthy, "constant")


@pytest.fixture(scope="module")
def compared(healthy):
    return nnhydro.benchmark(healthy, ["textbook", "constant"], folds=2)


def test_a_folder_stands_for_its_campaign_and_anything_else_is_refused_in_one_line(tmp_path, healthy, fitted):
    folder = write_folder(healthy, tmp_path / "tank")
    for given in (folder, str(folder)):
        assert nnhydro.check(given).to_frame().equals(nnhydro.check(nnhydro.load(folder)).to_frame())
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


def results(healthy, fitted, compared):
    run = healthy.load("run1")
    return {"Check": nnhydro.check(healthy), "Model": fitted, "Prediction": fitted.predict(run), "Benchmark": compared,
            "Catalogue": nnhydro.catalogue(), "network": nnhydro.train(healthy, TINY)}


@pytest.mark.slow
def test_every_result_says_its_verdict_as_text_in_a_notebook_and_as_a_frame(healthy, fitted, compared):
    for name, result in results(healthy, fitted, compared).items():
        sentence = result.verdict()
        assert sentence.endswith("."), name
        assert "\n" not in sentence, name
        assert repr(result).splitlines()[0] == f"{type(result).__name__}: {sentence}"
        assert sentence in text_of(result._repr_html_())
        frame = result.to_frame()
        assert isinstance(frame, pd.DataFrame)
        assert len(frame) > 0, name
        assert max(map(len, repr(result).splitlines())) < 400, name


def test_what_is_shown_is_escaped(healthy):
    a = arm().model_copy(update={"name": "<script>alert(1)</script>"})
    sheet = Sheet("<b>", (Column("<i>", ["<script>"], words=True),))
    assert "<script>" not in sheet.html()
    assert "<script>" in text_of(sheet.html())
    assert "<script>" in repr(nnhydro.Campaign.of(a, list(healthy.recordings())))


def test_a_model_finds_what_was_planted_and_says_it_in_a_frame(fitted):
    frame = fitted.to_frame().set_index("parameter")
    for name, truth in (("normal_drag.C_D[1]", 0.9), ("normal_drag.C_D[2]", 1.3), ("added_mass.C_M[1]", 0.8)):
        assert frame.loc[name, "value"] == pytest.approx(truth, abs=0.1)
        assert frame.loc[name, "ci95_low"] <= frame.loc[name, "value"] <= frame.loc[name, "ci95_high"]
    assert fitted.name == "constant"
    assert fitted.arm.n_links == 2


def test_a_model_predicts_the_same_from_a_recording_a_frame_and_a_file(fitted, healthy, tmp_path):
    run = angles_only(healthy.load("run1"))
    folder = write_folder(nnhydro.Campaign.of(healthy.arm, [run]), tmp_path / "c")
    frame = pd.DataFrame(columns_of(run))
    made = [fitted.predict(run), fitted.predict(frame), fitted.predict(folder / "recordings" / "run1.csv")]
    for other in made[1:]:
        np.testing.assert_allclose(other.tau, made[0].tau, rtol=1e-12, atol=1e-12)
    table = made[0].to_frame()
    assert list(table) == ["t_s", "tau1_Nm", "tau2_Nm", "outside"]
    assert len(table) == len(run) == len(made[0])
    written = pd.read_csv(made[0].save(tmp_path / "torque.csv"))
    np.testing.assert_allclose(written, table, rtol=1e-8)


def test_a_model_is_the_same_after_it_was_saved(fitted, healthy, tmp_path):
    again = nnhydro.load_model(fitted.save(tmp_path / "model"))
    np.testing.assert_array_equal(again.predict(healthy.load("run2")).tau, fitted.predict(healthy.load("run2")).tau)
    pd.testing.assert_frame_equal(again.to_frame(), fitted.to_frame())


def test_a_frame_becomes_a_recording_or_says_which_column_is_missing(healthy):
    run = recording(arm(), planted(arm()), seconds=1.0)
    frame = pd.DataFrame(columns_of(run)).assign(comment="kept out")
    read = nnhydro.read_frame(frame, arm(), "run9")
    np.testing.assert_array_equal(read.tau, run.tau)
    assert read.name == "run9"
    with pytest.raises(nnhydro.NnhydroError, match="column 'q2_rad' is missing"):
        nnhydro.read_frame(frame.drop(columns="q2_rad"), arm())


def test_the_benchmark_frame_is_ranked_and_agrees_with_its_document(compared):
    frame = compared.to_frame()
    assert list(frame["model"]) == compared.ranking == ["constant", "textbook"]
    assert frame["error"].is_monotonic_increasing
    document = compared.document()["models"]
    assert frame["error"][0] == document["constant"]["error"]
    assert (frame["error_ci95_low"] <= frame["error"]).all()
    by_recording = compared.by_recording().set_index("recording")
    assert by_recording.loc["run1", "textbook"] == document["textbook"]["by_recording"]["run1"]


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


def test_a_campaign_that_looks_wrong_says_so_with_the_remedy(healthy):
    wrong = nnhydro.Campaign.of(healthy.arm, [nnhydro.read_frame(pd.DataFrame(columns_of(r)).assign(
        q1_rad=lambda x: x.q1_rad * 57.3, q2_rad=lambda x: x.q2_rad * 57.3).drop(
            columns=["dq1_rad_s", "dq2_rad_s", "ddq1_rad_s2", "ddq2_rad_s2"]), healthy.arm, r.name) for r in healthy.recordings()])
    found = nnhydro.check(wrong)
    assert any("deg" in message for message in found.oddities)
    assert not found.usable or found.verdict().startswith("Usable, but")
    with pytest.raises(nnhydro.NnhydroError, match="cutoff_hz"):
        nnhydro.check(healthy, cutoff_hz=-1)


def test_the_catalogue_explains_each_effect():
    known = nnhydro.catalogue()
    assert len(known) == len(known.to_frame()) >= 30
    assert set(known) == set(known.to_frame()["id"])
    assert known["coulomb_friction"]["parameters"][0]["unit"] == "N m"


@pytest.mark.slow
def test_a_diagnosis_says_the_same_in_python_as_in_its_file(tmp_path):
    a = arm()
    c = campaign(a, planted(a), count=6, noise=0.01, rate=50.0)
    found = nnhydro.diagnose(c)
    document = json.loads((found.save(tmp_path / "d")[0]).read_text())
    assert [f.effect for f in found.findings] == [f["effect"] for f in document["findings"]]
    assert found.detected == document["mismatch"]["detected"]
    assert len(found.to_frame()) == len(found.findings)
    assert found.verdict() in repr(found)
    assert found.baseline.name == "constant"
    run = c.load("run0")
    np.testing.assert_array_equal(found.corrected.predict(run).tau, nnhydro.load_model(tmp_path / "d" / "model").predict(run).tau)


@pytest.mark.parametrize(("values", "cells"), [([0.5, None], ["50.0 %", ""]), ([(1, 2), None], None)])
def test_a_cell_without_a_value_is_empty(values, cells):
    column = Column("x", values, percent if cells else "{}")
    assert cells is None or column.cells() == cells
    assert len(Sheet("", (column,)).frame()) == 2
    assert Sheet("", (column,)).frame().iloc[1].isna().all()
