"""Copies are told as copies, p is never 0, what comes next follows from the result, and no fault of a sensor reaches a controller."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from campaigns import GIVEN, TINY, campaign, columns_of, planted, recording, write_csv, write_folder
from rigs import arm

from nnhydro.cli.diagnose import next_steps, warn_of_seen
from nnhydro.cli.main import run
from nnhydro.fitting.identify import identify
from nnhydro.fitting.network.train import train
from nnhydro.models.storage import save_model
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.repeats import noise_floor
from nnhydro.recordings.survey import survey
from nnhydro.sheet import p_text

A = arm(2)


# copies
def copied(noise=0.05):
    whole = campaign(A, planted(A), 3, noise=noise, seconds=3.0, rate=50.0)
    runs = list(whole.recordings())
    return Campaign.of(A, [*runs, replace(runs[0], name="again")])


def test_copies_of_one_file_are_told_as_copies():
    found = [x for x in survey(copied()).oddities if x.check == "copies"]
    assert len(found) == 1
    assert found[0].where == "run0, again"
    assert "copies of one run" in found[0].what


def test_copies_say_nothing_of_the_noise():
    """They used to say that a perfect model leaves 0 %."""
    assert noise_floor(copied(), GIVEN) is None


def test_repeats_beside_copies_still_tell_the_noise():
    def once(k):
        r = recording(A, planted(A), "x", 1, seconds=3.0, rate=50.0)
        return replace(r, name=f"r{k}", tau=r.tau + 0.05 * np.random.default_rng(k).standard_normal(r.tau.shape))

    two = [once(1), once(2)]
    plain, with_copy = (noise_floor(Campaign.of(A, runs), GIVEN) for runs in (two, [*two, replace(two[0], name="copy")]))
    assert with_copy.error == pytest.approx(plain.error)
    assert with_copy.groups == (("r1", "r2"),)


def test_different_recordings_are_no_copies():
    assert not [x for x in survey(campaign(A, planted(A), 3, noise=0.05, seconds=3.0, rate=50.0)).oddities if x.check == "copies"]


# p
@pytest.mark.parametrize(("p", "draws", "text"), [
    (0.0, None, "p < 0.001"), (1e-3, None, "p < 0.001"), (0.0341, None, "p = 0.034"), (0.0, 99, "p < 0.01"), (0.5, None, "p = 0.500"),
    (0.0, 9999, "p < 0.0001"), (0.0002, 9999, "p = 0.0002"), (1e-12, None, "p < 0.001"), (float("nan"), None, "p < 0.001")])
def test_p_is_never_zero(p, draws, text):
    assert p_text(p, draws) == text
    assert "0.000 " not in p_text(p, draws) + " "


# what comes next
def test_check_sends_to_what_the_result_asks_for(tmp_path, capsys):
    good = write_folder(campaign(A, planted(A), 3, noise=0.02, seconds=4.0, rate=50.0), tmp_path / "good")
    bad = write_folder(copied(), tmp_path / "bad")
    lone = write_folder(campaign(A, planted(A), 1, noise=0.02, seconds=4.0, rate=50.0), tmp_path / "lone")
    for folder, command in ((good, "nnhydro benchmark"), (bad, "correct what is named above"), (lone, "nnhydro identify")):
        assert run(["check", str(folder)]) == 0
        assert f"Next: {command}" in capsys.readouterr().out


def diagnosed(named=0, detected=True, floor=0.01, chance=None, remains=False, driven=True):
    """What the end of a diagnosis looks at."""
    proposal = None if chance is None else SimpleNamespace(chance=chance)
    return SimpleNamespace(findings=[None] * named, detected=detected, noise_floor=floor, following=proposal,
                           remainder=SimpleNamespace(detected=remains), heldout=SimpleNamespace(driven=driven))


@pytest.mark.parametrize(("result", "words"), [
    (diagnosed(1), "nnhydro gains 'my diagnosis/model'"), (diagnosed(0, False), "nnhydro gains 'my diagnosis/model'"),
    (diagnosed(1, remains=True), "nnhydro train c --out my_model"),
    (diagnosed(0), "nnhydro train c --out my_model   (a hybrid learns what has no name"),
    (diagnosed(1, remains=True, driven=False), "open my diagnosis/report.html"),
    (diagnosed(0, False, 0.5), "nnhydro power c   (what these motions could reveal)"),
    (diagnosed(1, chance=0.9), "record the motion in my diagnosis/next_experiment.csv"),
    (diagnosed(1, chance=0.01), "nnhydro gains 'my diagnosis/model'")])
def test_a_diagnosis_sends_to_what_its_result_asks_for(result, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert next_steps(result, Path("my diagnosis"), Path("c"), None).startswith(words)


def test_a_prediction_sends_to_what_its_result_asks_for(tmp_path, capsys):
    whole = campaign(A, planted(A), 3, noise=0.02, seconds=4.0, rate=50.0)
    folder = write_folder(whole, tmp_path / "c")
    assert run(["identify", str(folder), "--out", str(tmp_path / "m"), "--quiet"]) == 0
    known = whole.load("run0")
    fast = replace(known, name="fast", qd=8 * known.qd, qdd=64 * known.qdd)
    for r, words in ((known, "nnhydro gains"), (fast, "record motions like fast")):
        write_csv(tmp_path / f"{r.name}.csv", columns_of(replace(r, q=known.q), torque=False))
        capsys.readouterr()
        assert run(["predict", str(tmp_path / "m"), str(tmp_path / f"{r.name}.csv"), "--out", str(tmp_path / "t")]) == 0
        out, err = capsys.readouterr()
        assert f"Next: {words if not err else 'correct what is named above'}" in out


def test_a_baseline_that_has_seen_the_recordings_is_told(tmp_path, capsys):
    """Errors of a network on its own recordings are no predictions, whatever is held out of the fit of the effects."""
    whole = campaign(A, planted(A), 3, noise=0.02, seconds=3.0, rate=50.0)
    some = Campaign.of(A, [whole.load("run0"), whole.load("run1")])
    network = str(save_model(train(some, TINY), tmp_path / "network"))
    physics = str(save_model(identify(some, "constant"), tmp_path / "physics"))
    for baseline, words in ((network, "has seen 2 of the 3 recordings here (run0, run1)"), (physics, ""), ("", ""), ("constant", "")):
        warn_of_seen(baseline, whole)
        err = capsys.readouterr().err
        assert words in err
        assert bool(words) == bool(err)


# faults of sensors and controllers
def test_the_report_says_that_the_choice_of_effects_has_seen_what_the_fit_has_not():
    from importlib.resources import files

    page = (files("nnhydro.report.widgets") / "diagnosis.html").read_text(encoding="utf-8")
    assert "All recordings were used to choose the effects" in page
    assert "took no part" not in page
