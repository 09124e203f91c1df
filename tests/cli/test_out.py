"""No command writes over a file that it did not write itself, its inputs least of all: tried for every command that takes --out."""

import inspect
import json
import shutil

import pytest
import yaml
from campaigns import campaign, planted, write_folder
from rigs import arm

from nnhydro.cli.main import build, run
from nnhydro.runtime.files import whole_folder, write_output
from nnhydro.runtime.stamp import STAMP, content_of, is_system_file

URDF = """<robot name="r"><link name="base"/><link name="upper"><inertial><mass value="1"/><origin xyz="0.25 0 0"/>
<inertia ixx="0.01" iyy="0.01" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link><link name="tip"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/></joint>
<joint name="j2" type="fixed"><parent link="upper"/><child link="tip"/><origin xyz="0.5 0 0"/></joint></robot>"""


RECIPE = {"arm": arm(1).document(), "terms": {"normal_drag": {"C_D": 1.0}},
          "motions": [{"kind": "slew", "name": "reach", "q_rad": [[0.0], [1.0]], "duration_s": 1.0}]}


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A campaign, a model of it and its motions to predict."""
    root, a = tmp_path_factory.mktemp("place"), arm(1)
    write_folder(campaign(a, planted(a), 3, noise=0.02, seconds=2.0, rate=50.0), root / "campaign")
    assert run(["identify", str(root / "campaign"), "--out", str(root / "model"), "--quiet"]) == 0
    (root / "robot.urdf").write_text(URDF)
    return root


def folder_commands(place):
    """Arguments and marker of every command whose --out is a folder that is replaced whole."""
    campaign_, model = place / "campaign", place / "model"
    return {"identify": ([campaign_], "digest.txt"), "train": ([campaign_], "digest.txt"), "diagnose": ([campaign_], "diagnosis.json"),
            "benchmark": ([campaign_], "benchmark.json"), "gains": ([model], "gains.json"), "reproduce": ([], "reproduction.json"),
            "conceal": ([], "suite.json"), "simulate": ([place / "recipe.yaml"], "recipe.json")}


FOLDERS = ("identify", "train", "diagnose", "benchmark", "gains", "reproduce", "conceal", "simulate")
FILES = ("predict", "export", "arm", "effects")


def test_every_command_that_takes_out_is_tried_here():
    with_out = {command.name for command in build().registered_commands if "out" in inspect.signature(command.callback).parameters}
    assert with_out == {*FOLDERS, *FILES, "demo"}  # demo writes by the functions behind benchmark, train, predict and diagnose


def refused(capsys, arguments, *words):
    capsys.readouterr()
    assert run([str(a) for a in arguments]) == 2
    out, err = capsys.readouterr()
    assert not out
    assert err.count("\n") == 1, err
    for word in words:
        assert word in err, err


@pytest.mark.parametrize("name", FOLDERS)
@pytest.mark.parametrize("how", ["added", "changed"])
def test_a_folder_of_results_with_a_file_of_somebodys_own_is_not_replaced(place, name, how, tmp_path, capsys):
    (place / "recipe.yaml").write_text(yaml.safe_dump(RECIPE))
    arguments, marker = folder_commands(place)[name]
    with whole_folder(tmp_path / "out", marker) as work:
        (work / marker).write_text("{}")
        (work / "deep").mkdir()
        (work / "deep" / "x.csv").write_text("1")
    own = tmp_path / "out" / "deep" / ("mine.csv" if how == "added" else "x.csv")
    own.write_text("measured once")
    refused(capsys, [name, *arguments, "--out", tmp_path / "out"], str(own), "did not write", "name another place")
    assert own.read_text() == "measured once"


def test_predictions_never_replace_the_motions_they_were_made_from(place, tmp_path, capsys):
    motions = tmp_path / "motions"
    motions.mkdir()
    text = (place / "campaign" / "recordings" / "run0.csv").read_text()
    (motions / "run0.csv").write_text(text)
    refused(capsys, ["predict", place / "model", motions / "run0.csv", "--out", motions], "run0.csv", "is one of the inputs")
    assert (motions / "run0.csv").read_text() == text
    assert not (motions / STAMP).exists()


def test_predictions_never_replace_a_link_to_the_motion(place, tmp_path, capsys):
    original = place / "campaign" / "recordings" / "run0.csv"
    (tmp_path / "run0.csv").symlink_to(original)
    refused(capsys, ["predict", place / "model", original, "--out", tmp_path], "is one of the inputs")
    assert (tmp_path / "run0.csv").is_symlink()


def test_predictions_never_replace_other_recordings(place, tmp_path, capsys):
    (tmp_path / "run0.csv").write_text("another rig's")
    motion = place / "campaign" / "recordings" / "run0.csv"
    refused(capsys, ["predict", place / "model", motion, place / "campaign" / "recordings" / "run1.csv", "--out", tmp_path], "run0.csv",
            "did not write it")
    assert [p.name for p in tmp_path.iterdir()] == ["run0.csv"]


def test_predictions_of_an_earlier_run_are_replaced_unless_they_were_changed(place, tmp_path, capsys):
    arguments = ["predict", place / "model", place / "campaign" / "recordings" / "run0.csv", "--out", tmp_path, "--quiet"]
    assert run([str(a) for a in arguments]) == 0
    assert run([str(a) for a in arguments]) == 0
    with (tmp_path / "run0.csv").open("a") as file:
        file.write("# my remark\n")
    refused(capsys, arguments, "changed since")


@pytest.mark.parametrize(("name", "file", "victim"), [
    ("export", "arm.onnx", "arm.onnx"), ("export", "arm.onnx", "arm.onnx.json"), ("arm", "arm.yaml", "arm.yaml"),
    ("effects", "picture.png", "picture.png"), ("effects", "picture.png", "picture.csv")])
def test_a_file_of_somebodys_own_is_not_replaced(place, name, file, victim, tmp_path, capsys):
    first = {"export": [place / "model"], "arm": [place / "robot.urdf", "--diameter", "0.05"], "effects": ["coulomb_friction"]}[name]
    (tmp_path / victim).write_text("mine")
    refused(capsys, [name, *first, "--out", tmp_path / file], victim, "is there already")
    assert [p.name for p in tmp_path.iterdir()] == [victim]
    assert (tmp_path / victim).read_text() == "mine"


def test_a_mujoco_file_of_somebodys_own_is_not_replaced(place, tmp_path, capsys):
    (tmp_path / "arm.xml").write_text("mine")
    refused(capsys, ["export", place / "model", "--format", "mujoco", "--out", tmp_path / "arm.xml"], "arm.xml", "did not write it")
    assert (tmp_path / "arm.xml").read_text() == "mine"


def test_a_file_that_lies_where_a_training_keeps_its_state_is_not_removed(place, tmp_path, capsys):
    own = tmp_path / "net.checkpoint.safetensors"
    own.write_text("mine")
    refused(capsys, ["train", place / "campaign", "--out", tmp_path / "net"], str(own), "no training wrote it")
    assert own.read_text() == "mine"


def test_results_of_other_commands_inside_a_folder_of_results_may_go_with_it(tmp_path):
    with whole_folder(tmp_path / "out", "mark") as work:
        (work / "x").write_text("1")
    write_output(tmp_path / "out" / "torques" / "run.csv", "t_s\n")
    (tmp_path / "out" / ".DS_Store").write_text("the system's")
    with whole_folder(tmp_path / "out", "mark") as work:
        (work / "y").write_text("2")
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [STAMP, "mark", "y"]


def test_a_folder_without_a_list_of_what_was_written_is_not_replaced(tmp_path):
    from nnhydro.errors import ConfigError

    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mark").write_text("by hand")
    with pytest.raises(ConfigError, match="did not write"), whole_folder(tmp_path / "out", "mark"):
        pass


def test_the_list_names_every_file_with_its_content(place):
    listed = json.loads((place / "model" / STAMP).read_text())["files"]
    assert listed == {p.name: content_of(p) for p in (place / "model").iterdir() if not is_system_file(p.name)}


def test_a_link_to_a_folder_of_results_stays_a_link_and_its_folder_is_replaced(place, tmp_path):
    arguments = ["identify", str(place / "campaign"), "--quiet", "--out"]
    assert run([*arguments, str(tmp_path / "model")]) == 0
    (tmp_path / "latest").symlink_to(tmp_path / "model")
    before = (tmp_path / "model").stat().st_ino
    assert run([*arguments, str(tmp_path / "latest")]) == 0
    assert (tmp_path / "latest").is_symlink()
    assert (tmp_path / "model").stat().st_ino != before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["latest", "model"]


def simulated(folder):
    """A campaign that nnhydro itself wrote."""
    (folder / "recipe.yaml").write_text(yaml.safe_dump(RECIPE))
    assert run(["simulate", str(folder / "recipe.yaml"), "--out", str(folder / "tank"), "--quiet"]) == 0
    return folder / "tank"


@pytest.mark.parametrize("form", ["c", "mujoco", "curves", "onnx", "casadi"])
def test_an_export_never_replaces_a_file_of_a_campaign_that_nnhydro_wrote(place, form, tmp_path, capsys):
    tank = simulated(tmp_path)
    before = (tank / "arm.yaml").read_bytes()
    refused(capsys, ["export", place / "model", "--format", form, "--out", tank / "arm.yaml"], str(tank / "arm.yaml"), "name another file")
    refused(capsys, ["export", place / "model", "--format", form, "--out", tank / "recipe.json"], "name another file")
    assert (tank / "arm.yaml").read_bytes() == before


@pytest.mark.parametrize("name", ["model.json", "digest.txt"])
@pytest.mark.parametrize("listed", ["now", "by 0.2.0"])
def test_an_export_never_replaces_a_part_of_a_model(place, name, listed, tmp_path, capsys):
    model = tmp_path / "model"
    shutil.copytree(place / "model", model)
    if listed == "by 0.2.0":
        document = json.loads((model / STAMP).read_text())
        del document["whole"]
        (model / STAMP).write_text(json.dumps(document))
    before = (model / name).read_bytes()
    for exported in (model, place / "model"):
        refused(capsys, ["export", exported, "--format", "c", "--out", model / name], str(model / name), "name another file")
    assert (model / name).read_bytes() == before


def test_a_picture_never_replaces_a_picture_of_other_results(place, tmp_path, capsys):
    assert run(["gains", str(place / "model"), "--out", str(tmp_path / "gains"), "--quiet"]) == 0
    refused(capsys, ["effects", "coulomb_friction", "--out", tmp_path / "gains" / "gains.png"], "as a whole", "name another file")


def test_the_description_of_a_campaign_made_from_a_urdf_is_not_replaced(place, tmp_path, capsys):
    described = tmp_path / "tank" / "arm.yaml"
    assert run(["arm", str(place / "robot.urdf"), "--diameter", "0.05", "--out", str(described), "--quiet"]) == 0
    (tmp_path / "tank" / "recordings").mkdir()
    refused(capsys, ["export", place / "model", "--format", "curves", "--out", described], "describes the campaign", "name another file")


def test_a_file_beside_a_model_is_replaced_by_the_command_that_wrote_it(place, tmp_path):
    model = tmp_path / "model"
    shutil.copytree(place / "model", model)
    for _ in range(2):
        assert run(["export", str(model), "--format", "mujoco", "--out", str(model / "arm.xml"), "--quiet"]) == 0


@pytest.mark.parametrize("how", ["--baseline", "--models"])
def test_results_never_replace_the_model_that_they_were_made_with(place, how, tmp_path, capsys):
    command, marker = ("diagnose", "diagnosis.json") if how == "--baseline" else ("benchmark", "benchmark.json")
    with whole_folder(tmp_path / "found", marker) as work:
        (work / marker).write_text("{}")
        shutil.copytree(place / "model", work / "model")
    named = tmp_path / "found" / "model"
    refused(capsys, [command, place / "campaign", how, named if how == "--baseline" else f"constant,{named}", "--out", tmp_path / "found"],
            str(named), "would be lost", "name another folder")
    assert named.is_dir()


def test_a_training_never_replaces_the_model_that_it_builds_on(place, tmp_path, capsys):
    shutil.copytree(place / "model", tmp_path / "model")
    (tmp_path / "config.toml").write_text(f"baseline = '{tmp_path / 'model'}'\n")
    refused(capsys, ["train", place / "campaign", "--config", tmp_path / "config.toml", "--out", tmp_path / "model"], "would be lost")
    same = {file.name: file.read_bytes() for file in (place / "model").iterdir()}
    assert {file.name: file.read_bytes() for file in (tmp_path / "model").iterdir()} == same
