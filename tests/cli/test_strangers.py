"""A stranger's folder from its files to a verdict by commands alone, without a script: foreign formats, and arms that hide something."""

import importlib.util
import io
import json
import shutil
import time
from contextlib import redirect_stdout
from functools import cache
from pathlib import Path

import pytest
from strangers import C_D, C_M, HEALTHY, HIDING, write

from nnhydro.cli.main import run

LONGEST = 60.0  # s, of check, benchmark, identify and predict together, on one core


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    root = tmp_path_factory.mktemp("strangers")
    return {kind: write(root / kind, kind, 4 if kind in HIDING else 6) for kind in (*HEALTHY, *HIDING)}


@pytest.fixture(scope="module", autouse=True)
def without_figures():
    """What is compared and diagnosed is written without its figures: tests of reports draw them."""
    with pytest.MonkeyPatch.context() as patch:
        for page in ("benchmark.page.benchmark_figures", "diagnosis.page.diagnosis_figures"):
            patch.setattr(f"nnhydro.report.{page}", lambda *given: [])
        yield


@pytest.fixture(scope="module")
def diagnoses(folders, tmp_path_factory):
    """The diagnosis of a stranger's folder, made once: the folder, and what it prints for programs."""
    @cache
    def of(kind):
        out, printed = tmp_path_factory.mktemp("diagnosis") / "d", io.StringIO()
        with redirect_stdout(printed):
            assert run(["diagnose", str(folders[kind]), "--out", str(out), "--json"]) == 0
        return out, json.loads(printed.getvalue())
    return of


def said(capsys, *arguments):
    capsys.readouterr()
    code = run([str(a) for a in arguments])
    out, err = capsys.readouterr()
    assert code == 0, err
    return out


@pytest.mark.slow
@pytest.mark.parametrize("kind", HEALTHY)
def test_a_healthy_arm_in_foreign_files_is_read_explained_and_predicted(kind, folders, tmp_path, capsys):
    folder, start = folders[kind], time.perf_counter()
    looked_at = said(capsys, "check", folder)
    assert "Usable" in looked_at
    for words in {"German": ("decimal commas", "dates and times of day", "units from the row", "text in utf-16"), "20 Hz": (),
                  "1 kHz": ("time stamps that repeat (0.4%)",)}[kind]:
        assert words in looked_at, looked_at
    compared = said(capsys, "benchmark", folder, "--models", "constant,textbook,drag-only", "--out", tmp_path / "b")
    assert "On recordings that no fit has seen, constant predicts the torques best" in compared
    assert "Next: nnhydro identify" in compared
    found = json.loads(said(capsys, "identify", folder, "--out", tmp_path / "m", "--json"))["parameters"]
    assert found["normal_drag.C_D[1]"]["value"] == pytest.approx(C_D, rel=0.05)
    assert found["added_mass.C_M[1]"]["value"] == pytest.approx(C_M, abs=0.15)
    motion = next(p for p in sorted((folder / "recordings").iterdir()) if p.name != "Thumbs.db")
    document = json.loads(said(capsys, "predict", tmp_path / "m", motion, "--out", tmp_path / "t", "--json"))
    assert document["outside_share"][0] < 0.05
    assert time.perf_counter() - start < LONGEST


@pytest.mark.slow
@pytest.mark.parametrize("kind", HIDING)
def test_an_arm_that_hides_something_is_sent_to_the_diagnosis(kind, folders, tmp_path, capsys):
    said(capsys, "check", folders[kind])
    compared = said(capsys, "benchmark", folders[kind], "--models", "constant,textbook", "--out", tmp_path / "b")
    assert "Next: nnhydro diagnose" in compared


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*HEALTHY, *HIDING])
def test_the_diagnosis_of_a_strangers_folder_ends_in_a_verdict(kind, diagnoses):
    _, document = diagnoses(kind)
    named = {finding["effect"] for finding in document["findings"]}
    assert named == set() if kind in HEALTHY else document["mismatch"]["detected"]


@pytest.mark.slow
def test_the_transcript_is_what_its_script_types(monkeypatch, capsys):
    """training/strangers/run.py on one kind: every command ends well, names the next one, and the verdict is true."""
    def type_in(command, place):
        monkeypatch.chdir(place)
        return said(capsys, *command.split()), 0.0, 0.0

    path = Path(__file__).resolve().parents[2] / "training" / "strangers" / "run.py"
    spec = importlib.util.spec_from_file_location("strangers_walk", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "type_in", type_in)  # here, without a new Python for every command
    typed, told = module.walk("20 Hz")
    assert [step["command"] for step in told["steps"]] == ["check", "benchmark", "identify", "diagnose", "predict"]
    assert sum(line.startswith("Next: nnhydro ") for line in typed) == 5
    assert told["named"] == []
    assert not told["detected"]
    assert told["C_D"] == pytest.approx(C_D, rel=0.05)
    shipped = json.loads((path.parent / "results.json").read_text())
    assert set(shipped["kinds"]) == {*HEALTHY, *HIDING}
    assert all(kind in (path.parent / "transcript.txt").read_text() for kind in shipped["kinds"])


@pytest.mark.slow
def test_what_a_diagnosis_has_seen_is_no_proof_for_its_model(diagnoses, tmp_path, capsys):
    """A diagnosed model on the recordings of its own diagnosis, under other names, beside ones that it has not seen."""
    model = diagnoses("20 Hz")[0] / "model"
    write(tmp_path / "c", "20 Hz")
    recordings = sorted((tmp_path / "c" / "recordings").glob("*.csv"))
    for k, recording in enumerate(recordings):
        recording.rename(recording.with_name(f"renamed {k}.csv"))
    arguments = ["benchmark", str(tmp_path / "c"), "--models", f"constant,{model}", "--out", str(tmp_path / "b")]
    assert run(arguments) == 2
    assert "has seen 6 of the 6 recordings" in capsys.readouterr().err
    shutil.rmtree(tmp_path / "c")
    write(tmp_path / "c", "20 Hz", count=8)
    assert "6 recordings not compared" in said(capsys, *arguments)
