"""`nnhydro gains` and `nnhydro export` as a user meets them."""

import json
import re

import pytest
from campaigns import GIVEN, TINY, campaign, planted, write_folder
from rigs import arm
from untrained import learned

from nnhydro.fitting.network.train import train
from nnhydro.models.storage import save_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.runtime.stamp import STAMP


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with a physics model and a tiny hybrid."""
    root, a = tmp_path_factory.mktemp("place"), arm(2)
    save_model(StripTheory(a, GIVEN, {}, "constant", planted(a)), root / "constant")
    save_model(train(campaign(a, planted(a), 3, seconds=1.5, rate=50.0), TINY), root / "hybrid")
    return root


@pytest.mark.parametrize("name", ["constant", pytest.param("hybrid", marks=pytest.mark.slow)])
def test_gains_writes_a_table_a_plot_and_the_matrices(place, said, tmp_path, name):
    code, out, _ = said("gains", place / name, "--out", tmp_path / "g", *(["--json"] if name == "hybrid" else []))
    assert code == 0
    assert sorted(p.name for p in (tmp_path / "g").iterdir() if p.name != STAMP) == ["gains.csv", "gains.json", "gains.png", "gains.svg"]
    written = json.loads((tmp_path / "g" / "gains.json").read_text())
    assert written["schema"] == "nnhydro/gains/1"
    if name == "hybrid":
        assert json.loads(out) == written
        assert written["inertia_check"]["states"] > 50
    else:
        assert "damping, textbook" in out


@pytest.mark.parametrize(("option", "value", "word"), [("--speed", "0", "--speed"), ("--speed", "nan", "--speed"),
                                                       ("--tow", "inf", "--tow"), ("--tow", "1e9", "between -1000 and 1000"),
                                                       ("--posture", "a,b", "--posture"), ("--posture", "1,2,3", "3 angles"),
                                                       ("--posture", "0", "1 angle for an arm of 2 joints: give all 2, as in --posture")])
def test_gains_refuses_states_that_are_none(place, said, tmp_path, option, value, word):
    code, out, err = said("gains", place / "constant", "--out", tmp_path / "g", option, value)
    assert (code, out) == (2, "")
    assert word in err
    assert len(err.splitlines()) == 1
    assert not (tmp_path / "g").exists()


def test_gains_keeps_somebody_elses_folder(place, said, tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    code, _, err = said("gains", place / "constant", "--out", tmp_path)
    assert code == 2
    assert "holds other files" in err


@pytest.mark.slow
def test_export_writes_the_file_and_what_it_needs_to_be_told(place, said, tmp_path):
    code, out, _ = said("export", place / "hybrid", "--out", tmp_path / "arm.onnx")
    assert code == 0
    assert "memory_next" in out
    assert sorted(p.name for p in tmp_path.iterdir()) == [STAMP, "arm.onnx", "arm.onnx.json"]
    told = json.loads((tmp_path / "arm.onnx.json").read_text())
    assert told["model_digest"] == (place / "hybrid" / "digest.txt").read_text().strip()
    code, out, _ = said("export", place / "constant", "--out", tmp_path / "other.onnx", "--json")
    assert code == 0
    told = json.loads((tmp_path / "other.onnx.json").read_text())
    assert json.loads(out) == {"file": str(tmp_path / "other.onnx"), **told}


@pytest.mark.parametrize(("options", "word"), [(("--format", "torchscript"), "onnx"), (("--precision", "half"), "single")])
def test_export_refuses_what_it_does_not_know(place, said, tmp_path, options, word):
    code, out, err = said("export", place / "constant", "--out", tmp_path / "a.onnx", *options)
    assert (code, out) == (2, "")
    assert word in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_export_of_a_model_over_the_travel_holds_its_memory(place, said, tmp_path):
    a = arm(2)
    save_model(StripTheory(a, GIVEN, {}, "state", state_loads(a)), tmp_path / "state")
    code, out, _ = said("export", tmp_path / "state", "--out", tmp_path / "a.onnx")
    assert code == 0
    assert "memory_next" in out
    code, out, _ = said("export", tmp_path / "state", "--format", "c", "--without-instruments", "--out", tmp_path / "a.h")
    assert code == 0
    assert sorted(p.name for p in tmp_path.glob("a.h*")) == ["a.h", "a.h.test.csv"]
    assert "a_step" in (tmp_path / "a.h").read_text()
    code, _, err = said("export", tmp_path / "state", "--format", "curves", "--without-instruments", "--out", tmp_path / "a.csv")
    assert code == 2
    assert "--without-instruments" in err
    assert not (tmp_path / "a.csv").exists()


@pytest.mark.parametrize("kind", ["casadi", "mujoco", "curves"])
def test_a_precision_that_a_format_does_not_have_is_refused(place, said, tmp_path, kind):
    code, out, err = said("export", place / "constant", "--format", kind, "--precision", "single", "--out", tmp_path / "a")
    assert (code, out) == (2, "")
    assert f"{kind} has no other than double" in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kind", ["curves", "mujoco"])
def test_the_command_that_a_hybrid_s_refusal_names_gives_a_model_that_is_exported(said, tmp_path, kind):
    a = arm(1)
    save_model(learned(a, hybrid=True), tmp_path / "hybrid")
    recordings = write_folder(campaign(a, planted(a), 2, seconds=1.5, rate=50.0), tmp_path / "campaign")
    code, _, err = said("export", tmp_path / "hybrid", "--format", kind, "--out", tmp_path / "a")
    assert (code, len(err.splitlines())) == (2, 1)
    (command,) = re.findall("nnhydro (identify .* --out PHYSICS),", err)
    known = {"CAMPAIGN": recordings, "PHYSICS": tmp_path / "physics"}
    assert said(*(known.get(word, word) for word in command.split()))[0] == 0
    assert said("export", tmp_path / "physics", "--format", kind, "--out", tmp_path / "a")[0] == 0
