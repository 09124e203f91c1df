"""`nnhydro effects` as a person types it: the list, a card, its picture, JSON, a file of one's own, and one line for each mistake."""

import json
import re
from pathlib import Path

import pytest
from campaigns import campaign, planted, write_folder
from hypotheses import PLUGIN
from rigs import arm

from nnhydro.cli.main import run
from nnhydro.effects.catalogue import catalogue
from nnhydro.runtime.stamp import STAMP


def test_the_list_names_every_effect(capsys):
    assert run(["effects"]) == 0
    out = capsys.readouterr().out
    assert f"{len(catalogue())} effects" in out
    for id_, cls in catalogue().items():
        assert id_ in out
        assert cls.family in out


@pytest.mark.parametrize("id_", catalogue())
def test_a_card_explains_the_effect(id_, capsys):
    assert run(["effects", id_]) == 0
    out = " ".join(capsys.readouterr().out.split())
    card = catalogue()[id_]
    for text in (card.mechanism, card.equation, card.signature.region, card.source, *(f.metadata["meaning"] for f in card.parameters())):
        assert " ".join(text.split()) in out


@pytest.mark.parametrize("id_", ["payload_mass", "stribeck_friction", "wave_orbital", "torque_saturation"])
def test_a_picture_is_drawn(id_, tmp_path: Path, capsys):
    out = tmp_path / "new" / f"{id_}.png"
    assert run(["effects", id_, "--out", str(out)]) == 0
    assert out.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert out.stat().st_size > 10_000
    assert sorted(p.name for p in out.parent.iterdir() if p.name != STAMP) == [f"{id_}.csv", f"{id_}.png", f"{id_}.svg"]
    assert str(out) in capsys.readouterr().out


def test_json_is_all_that_stands_on_standard_output(capsys):
    assert run(["effects", "--json"]) == 0
    cards = json.loads(capsys.readouterr().out)
    assert {card["id"] for card in cards} == set(catalogue())
    assert run(["effects", "stribeck_friction", "--json"]) == 0
    card = json.loads(capsys.readouterr().out)
    assert card["family"] == "dry_friction"
    assert [p["name"] for p in card["parameters"]] == ["sliding", "excess", "speed", "tail", "bending"]
    assert card["parameters"][2]["grid"]


@pytest.mark.usefixtures("catalogue_as_it_was")
def test_a_file_of_ones_own_adds_an_effect(tmp_path: Path, capsys):
    path = tmp_path / "mine.py"
    path.write_text(PLUGIN)
    assert run(["effects", "squeak", "--effects", str(path), "--out", str(tmp_path / "squeak.png")]) == 0
    assert "Squeak of a dry bush (squeak)" in capsys.readouterr().out
    assert run(["effects", "--effects", str(path)]) == 0
    assert f"{len(catalogue())} effects" in capsys.readouterr().out


@pytest.mark.parametrize(("arguments", "message"), [
    (["no_such_effect"], "unknown effect 'no_such_effect'"),
    (["coulomb"], "unknown effect 'coulomb': did you mean 'coulomb_friction'?"), (["--out", "x.png"], "needs an ID"),
    (["torque_bias", "--out", "x.pdf"], "ends in .png"), (["--effects", "no_such_file.py"], "is not a file"),
    (["torque_bias", "--out", "/proc/x/y.png"], "cannot be written"),
])
def test_mistakes_end_with_one_line(arguments, message, capsys):
    assert run(["effects", *arguments]) == 2
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1


BROKEN = {
    "an attribute that is not there": (".qd[", ".qdot[", r"AttributeError: 'Motion' object has no attribute 'qdot'"),
    "a division by zero": ("** 3", "** (3 // 0)", r"ZeroDivisionError"),
    "more joints than the arm has": ("flow.arm.n_links)", "flow.arm.n_links + 1)",
                                   r"of shape \(\d+, \d, 1\); it must be a tensor of shape \(\d+, \d, 1\)"),
    "a joint that the arm does not have": ("self.joint, flow", "self.joint + 5, flow", r"joint \d: this arm has \d"),
    "no answer at all": ("return at_joint", "at_joint", r"the answer is a NoneType"),
}


def require_one_line(code, err, path, wrong):
    assert code == 2
    assert err.count("\n") == 1, err
    assert re.search(rf"--effects {re.escape(str(path))}: line \d+, in columns: .*{wrong}", err), err


@pytest.mark.usefixtures("catalogue_as_it_was")
@pytest.mark.parametrize("fault", BROKEN)
def test_a_fault_in_a_file_of_ones_own_is_told_with_its_line_not_by_a_traceback(fault, tmp_path, said):
    was, now, wrong = BROKEN[fault]
    path = tmp_path / "mine.py"
    path.write_text(PLUGIN.replace(was, now))
    code, _, err = said("effects", "squeak", "--effects", path, "--out", tmp_path / "squeak.png")
    require_one_line(code, err, path, wrong)
    assert not (tmp_path / "squeak.png").exists()


@pytest.mark.usefixtures("catalogue_as_it_was")
def test_a_diagnosis_tells_a_fault_in_a_file_of_ones_own_with_its_line(tmp_path, said):
    a = arm(2)
    path = tmp_path / "mine.py"
    for number, name in enumerate(("one", "several/a")):
        write_folder(campaign(a, planted(a), 3, noise=0.02, seconds=2.0, rate=50.0), tmp_path / name)
        was, now, wrong = BROKEN["more joints than the arm has" if number else "an attribute that is not there"]
        path.write_text(PLUGIN.replace(was, now))
        code, _, err = said("diagnose", tmp_path / name.split("/")[0], "--effects", path, "--out", tmp_path / "found", "--quiet")
        require_one_line(code, err, path, wrong)


@pytest.mark.usefixtures("catalogue_as_it_was")
def test_an_exception_of_the_package_itself_is_not_hidden(tmp_path, monkeypatch):
    path = tmp_path / "mine.py"
    path.write_text(PLUGIN)
    monkeypatch.setattr("nnhydro.effects.catalogue.card", lambda effect: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        run(["effects", "squeak", "--effects", str(path), "--json"])
