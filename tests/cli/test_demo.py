"""`nnhydro demo`: train, compare, find what is hidden, and only then open the answer; and the concealed campaign that ships for it."""

import importlib.util
import json
import shutil
from pathlib import Path

import pytest

from nnhydro.blind_tests.reveal import read_suite
from nnhydro.blind_tests.seal import open_sealed, read_key
from nnhydro.cli.demo import _open_answer
from nnhydro.cli.main import run
from nnhydro.demo import CAMPAIGN, CONCEALED, CONCEALED_NAME
from nnhydro.runtime.stamp import STAMP

ROOT = Path(__file__).parents[2]


def answer():
    return open_sealed(CONCEALED / "answers" / f"{CONCEALED_NAME}.sealed", read_key(CONCEALED / "key.txt"),
                       read_suite(CONCEALED)[CONCEALED_NAME]["commitment"])


def score(**changes):
    return {"right": True, "joint": True, "named": ("coulomb_friction",), "error_before": 0.25, "error_after": 0.125, "error_true": 0.1,
            **changes}


def test_one_effect_of_the_catalogue_is_hidden_in_the_campaign_and_no_file_beside_the_seal_names_it():
    (hidden,) = answer()["effects"]
    assert hidden["shape"] == "plain"
    assert hidden["joint"] in (1, 2)
    texts = [p.read_text() for p in CONCEALED.rglob("*") if p.is_file()]
    assert len(texts) > 10
    assert not any(word in text for text in texts for word in (hidden["effect"], "friction"))


def test_the_opened_answer_says_what_was_hidden_and_what_the_correction_is_worth():
    said = _open_answer(answer(), score())
    assert "coulomb_friction at joint 2, level 0.4495 N m" in said
    assert "The diagnosis was right" in said
    assert "12.5 %" in said
    assert "25.0 %" in said
    assert "From the recorded motions, the true model itself has 10.0 %." in said


@pytest.mark.parametrize(("changes", "words"), [
    ({"right": False, "named": ("viscous_friction",)}, "was wrong (it named viscous_friction)"),
    ({"right": False, "joint": False, "named": ()}, "was wrong (it named nothing)"),
    ({"joint": False}, "was wrong (it named coulomb_friction)")])
def test_a_wrong_diagnosis_is_called_wrong(changes, words):
    assert words in _open_answer(answer(), score(**changes))


def test_motions_that_could_not_be_scored_are_not_spoken_of():
    assert "%" not in _open_answer(answer(), score(error_after=None))
    old = _open_answer(answer(), score(error_true=None))
    assert old.endswith("an error of 12.5 %, the baseline 25.0 %.")


def every_second(folder):
    """Every second recording of the demo's campaign, in a folder of its own."""
    shutil.copytree(CAMPAIGN, folder)
    for path in sorted((folder / "recordings").iterdir())[1::2]:
        path.unlink()
    return folder


@pytest.mark.slow(seconds=30)
@pytest.mark.usefixtures("brief_memories")
def test_the_demo_trains_compares_diagnoses_and_reveals_without_a_network(tmp_path, capsys, monkeypatch):
    def refuse(*_: object) -> None:
        raise AssertionError("the demo opened a connection")

    monkeypatch.setattr("socket.socket.connect", refuse)
    monkeypatch.setattr("nnhydro.demo.FOLDS", 2)  # less to learn from than the demo has, in half of its time
    monkeypatch.setattr("nnhydro.demo.MEMBERS", 2)
    monkeypatch.setattr("nnhydro.demo.CAMPAIGN", every_second(tmp_path / "campaign"))
    assert run(["demo", "--out", str(tmp_path / "out"), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    errors = {name: model["error"] for name, model in document["models"].items()}
    assert min(errors, key=errors.__getitem__) in ("network", "hybrid")
    assert {"rigid", "constant", "state"} <= errors.keys()
    (finding,) = document["diagnosis"]["findings"]
    assert document["score"]["right"], f"{finding['effect']} was named, {answer()['effects'][0]['effect']} is hidden"
    assert finding["joint"] == answer()["effects"][0]["joint"]
    assert document["score"]["error_after"] < document["score"]["error_before"]
    assert all(Path(path).exists() for path in document["written"])
    page = (tmp_path / "out" / "diagnosis" / CONCEALED_NAME / "report.html").read_text()
    assert finding["statement"] in page


@pytest.mark.slow
def test_the_concealed_campaign_is_what_its_script_makes(tmp_path, monkeypatch):
    spec = importlib.util.spec_from_file_location("make_demo", ROOT / "datasets" / "make_demo.py")
    make_demo = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(make_demo)
    monkeypatch.setattr(make_demo, "CONCEALED", tmp_path / "concealed")
    make_demo.conceal()
    made = {p.relative_to(tmp_path / "concealed") for p in (tmp_path / "concealed").rglob("*") if p.is_file() and p.name != STAMP}
    assert made == {p.relative_to(CONCEALED) for p in CONCEALED.rglob("*") if p.is_file() and p.name != STAMP}
    for path in made:
        assert (tmp_path / "concealed" / path).read_bytes() == (CONCEALED / path).read_bytes(), f"{path} is another one"
