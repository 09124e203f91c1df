"""The commands as a user meets them: exit codes, one line for every error, JSON alone on standard output, files whole."""

import json
from pathlib import Path

import numpy as np
import pytest
from campaigns import angles_only, campaign, columns_of, planted, recording, steady_table, write_csv, write_folder
from rigs import arm

from nnhydro.cli.main import run
from nnhydro.models.storage import load_model
from nnhydro.recordings.recording import Recording
from nnhydro.runtime.stamp import STAMP

TINY = "law = []\nhidden = [8]\nmembers = 2\nepochs = 3\nbatch = 256\n"
KEYS = {"schema", "protocol", "noise_floor", "models", "folds", "versions"}
OF_A_MODEL = {"error", "error_ci95", "nrmse", "vaf", "fit_s"}


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with a campaign of six recordings, a motion without torque, and a tiny configuration."""
    root, a = tmp_path_factory.mktemp("place"), arm(2)
    write_folder(campaign(a, planted(a), 6, noise=0.02, seconds=2.0, rate=50.0), root / "campaign")
    r = angles_only(recording(a, planted(a), seed=30, seconds=2.0, speed=0.4))
    write_csv(root / "campaign" / "unseen" / "motion.csv", columns_of(r, torque=False))
    (root / "tiny.toml").write_text(TINY)
    return root


@pytest.fixture(scope="module")
def model(place):
    assert run(["identify", str(place / "campaign"), "--out", str(place / "model"), "--json"]) == 0
    return place / "model"


def strict(text):
    """The one JSON document in `text`, without NaN."""
    def refuse(constant):
        raise AssertionError(constant)

    return json.loads(text, parse_constant=refuse)


def one_line(result, *words):
    """A user's error: exit 2, nothing on standard output, one line that names what is wrong."""
    code, out, err = result
    assert code == 2, err
    assert out == ""
    lines = [line for line in err.splitlines() if not line.startswith(("fold ", "epoch "))]
    assert len(lines) == 1, err
    assert lines[0].startswith("nnhydro: error: ")
    assert "Traceback" not in err
    for word in words:
        assert str(word) in lines[0]


def test_identify_writes_a_model_and_prints_its_coefficients(place, said, tmp_path):
    code, out, _ = said("identify", place / "campaign", "--out", tmp_path / "m")
    assert code == 0
    assert "normal_drag.C_D[1]" in out
    assert load_model(tmp_path / "m").name == "constant"
    code, out, _ = said("identify", place / "campaign", "--model", "textbook", "--out", tmp_path / "m", "--json")
    assert code == 0
    assert strict(out)["model"] == "textbook"
    assert load_model(tmp_path / "m").name == "textbook"


def test_identify_says_the_same_to_programs(place, said, tmp_path):
    code, out, _ = said("identify", place / "campaign", "--out", tmp_path / "m", "--json")
    assert code == 0
    document = strict(out)
    for e in document["parameters"].values():
        assert e["ci95"][0] <= e["value"] <= e["ci95"][1]
        assert e["unit"]
    assert document["parameters"]["normal_drag.C_D[2]"]["value"] == pytest.approx(1.3, rel=0.05)
    assert said("identify", place / "campaign", "--out", tmp_path / "m", "--json")[1] == out


def test_a_cutoff_is_taken_as_given(place, said, tmp_path):
    assert said("identify", place / "campaign", "--out", tmp_path / "m", "--cutoff", "6.5", "--json")[0] == 0
    assert load_model(tmp_path / "m").preparation.low_pass.cutoff_hz == 6.5


def test_train_writes_a_model_and_leaves_no_checkpoint(place, said, tmp_path):
    code, out, err = said("train", place / "campaign", "--config", place / "tiny.toml", "--out", tmp_path / "m", "--json")
    assert code == 0
    assert strict(out)["epochs"] == 3
    assert "epoch 3/3" in err
    assert load_model(tmp_path / "m").name == "hybrid"
    assert [p.name for p in tmp_path.iterdir()] == ["m"]


def test_a_training_on_one_recording_warns_that_nothing_is_watched(place, said, tmp_path):
    a = arm(1)
    folder = write_folder(campaign(a, planted(a), 1, seconds=1.0), tmp_path / "c")
    code, _, err = said("train", folder, "--config", place / "tiny.toml", "--out", tmp_path / "m")
    assert code == 0
    assert "warning: one recording: none is left to watch" in err
    assert "% of the rms torque to be learned" in err


def test_a_training_stopped_before_its_first_checkpoint_leaves_nothing_and_promises_nothing(place, said, tmp_path, monkeypatch):
    import nnhydro.fitting.network.train as training

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(training, "train", interrupted)
    command = ("train", place / "campaign", "--out", tmp_path / "m", "--config", place / "tiny.toml")
    code, _, err = said(*command)
    assert code == 130
    assert "stopped before the first checkpoint" in err
    assert " ".join(map(str, command)) in err, "the options that were used"
    assert "--resume" not in err
    assert not list(tmp_path.iterdir())


def test_a_training_can_be_followed_in_tensorboard(place, said, tmp_path):
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    command = ("train", place / "campaign", "--config", place / "tiny.toml", "--out", tmp_path / "m")
    assert said(*command, "--tensorboard", tmp_path / "log", "--json")[0] == 0
    log = EventAccumulator(str(tmp_path / "log")).Reload()
    errors = log.Scalars("validation error")
    assert [event.step for event in errors] == [1, 2, 3]
    assert all(0 < event.value < 10 for event in errors)


def test_a_log_for_tensorboard_needs_its_library(place, said, tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    one_line(said("train", place / "campaign", "--out", tmp_path / "m", "--tensorboard", tmp_path / "log"), "nnhydro[tensorboard]")


@pytest.mark.slow
def test_a_training_that_was_interrupted_is_resumed_and_no_other(place, said, tmp_path, monkeypatch):
    import nnhydro.fitting.network.train as training

    def interrupted(*arguments, **keys):
        *first, checkpoint, _ = arguments

        def stop(epoch, epochs, error):
            if epoch == 1:
                raise KeyboardInterrupt
        return whole(*first, checkpoint, stop)

    whole = training.train
    command = ("train", place / "campaign", "--config", place / "tiny.toml", "--out", tmp_path / "m")
    assert said(*command, "--json")[0] == 0
    straight = load_model(tmp_path / "m").arrays()
    one_line(said(*command, "--resume"), "no interrupted training")
    with monkeypatch.context() as patch:
        patch.setattr(training, "train", interrupted)
        code, _, err = said(*command)
        assert code == 130
        assert "--resume" in err
    one_line(said("train", place / "campaign", "--out", tmp_path / "m", "--resume"), "another configuration")
    assert said(*command, "--resume", "--json")[0] == 0
    resumed = load_model(tmp_path / "m").arrays()
    assert all(np.array_equal(straight[key], resumed[key]) for key in straight)


def test_predict_writes_a_row_for_every_row(place, model, said, tmp_path):
    motion = place / "campaign" / "unseen" / "motion.csv"
    code, out, _ = said("predict", model, motion, "--out", tmp_path / "torques", "--json")
    assert code == 0
    document = strict(out)
    assert document["written"] == [str(tmp_path / "torques" / "motion.csv")]
    assert document["rows"] == [200]
    assert 0 <= document["outside_share"][0] < 0.2
    beside = strict((tmp_path / "torques" / "motion.json").read_text())
    assert document["cutoff_hz"] == [beside["cutoff_hz"]]
    assert beside["cutoff_hz"] > 1.0
    header, *rows = (tmp_path / "torques" / "motion.csv").read_text().splitlines()
    assert header == "t_s,tau1_Nm,tau2_Nm,outside"
    source = [line.split(",") for line in motion.read_text().splitlines()[1:]]
    values = np.array([[float(x) for x in row.split(",")] for row in rows])
    assert values[:, 0].tolist() == [float(row[0]) for row in source]
    assert np.isfinite(values).all()


def test_predict_takes_a_cutoff_and_says_which_it_used(place, model, said, tmp_path):
    command = ("predict", model, place / "campaign" / "unseen" / "motion.csv", "--out", tmp_path / "torques", "--cutoff")
    code, out, _ = said(*command, "3.5")
    assert code == 0
    assert "motion smoothed at 3.5 Hz" in out
    one_line(said(*command, "500"), "above half the sampling rate", "--cutoff")


def test_predict_takes_many_files_and_refuses_two_of_a_name(place, model, said, tmp_path):
    files = sorted((place / "campaign" / "recordings").glob("*.csv"))
    assert said("predict", model, *files, "--out", tmp_path / "torques")[0] == 0
    written = sorted(p.name for p in (tmp_path / "torques").iterdir() if p.name != STAMP)
    assert written == sorted(name for p in files for name in (p.name, f"{p.stem}.json"))
    other = tmp_path / "other" / files[0].name
    other.parent.mkdir()
    other.write_text(files[0].read_text())
    one_line(said("predict", model, files[0], other, "--out", tmp_path / "none"), files[0].stem)
    assert not (tmp_path / "none").exists()


def test_one_bad_motion_leaves_no_prediction_at_all(place, model, said, tmp_path):
    (tmp_path / "bad.csv").write_text("t_s,q1_rad,q2_rad\n" + "".join(f"{i / 10},0.1,{'' if i == 5 else 0.2}\n" for i in range(20)))
    good = place / "campaign" / "unseen" / "motion.csv"
    one_line(said("predict", model, good, tmp_path / "bad.csv", "--out", tmp_path / "t"), "bad.csv", "row 7")
    assert not (tmp_path / "t").exists()


def test_a_trained_model_predicts_its_uncertainty(place, said, tmp_path):
    assert said("train", place / "campaign", "--config", place / "tiny.toml", "--out", tmp_path / "m", "--json")[0] == 0
    assert said("predict", tmp_path / "m", place / "campaign" / "unseen" / "motion.csv", "--out", tmp_path / "t")[0] == 0
    assert (tmp_path / "t" / "motion.csv").read_text().startswith("t_s,tau1_Nm,tau2_Nm,tau1_std_Nm,tau2_std_Nm,outside\n")


@pytest.fixture
def compared(place, said):
    """Compare models with a seed; returns the document and the folder. What was compared once is not compared again."""

    def call(again="", models="constant,textbook,network,hybrid", seed=0):
        out = place / f"compared{again}_{models}_{seed}"
        if not out.exists():
            command = ("benchmark", place / "campaign", "--models", models, "--folds", "3", "--config", place / "tiny.toml")
            code, told, _ = said(*command, "--seed", seed, "--out", out, "--json")
            assert code == 0
            assert strict(told) == strict((out / "benchmark.json").read_text())
        return strict((out / "benchmark.json").read_text()), out

    return call


@pytest.mark.slow
def test_benchmark_compares_all_models_on_recordings_held_out_once(compared):
    document, out = compared()
    assert set(document) >= KEYS
    assert (document["schema"], document["protocol"]) == ("nnhydro/benchmark/1", "leave-recordings-out")
    assert set(document["models"]) == {"constant", "textbook", "network", "hybrid"}
    for result in document["models"].values():
        assert set(result) >= OF_A_MODEL
        assert np.isfinite([result["error"], *result["nrmse"], *result["vaf"], result["fit_s"]]).all()
        assert result["error_ci95"][0] <= result["error"] <= result["error_ci95"][1]
        assert len(result["nrmse"]) == len(result["vaf"]) == 2
    held_out = [name for fold in document["folds"] for name in fold["held_out"]]
    assert sorted(held_out) == [f"run{i}" for i in range(6)]
    assert all(set(fold["errors"]) == set(document["models"]) for fold in document["folds"])
    assert document["models"]["constant"]["error"] < document["models"]["textbook"]["error"]
    assert {p.suffix for p in out.iterdir()} == {".json", ".html", ".png", ".svg", ".csv"}
    assert (out / "reliability.csv").exists()


@pytest.fixture
def no_figures(compared, monkeypatch):
    """A benchmark is written without its figures, which the first one has."""
    compared()
    monkeypatch.setattr("nnhydro.report.benchmark.page.benchmark_figures", lambda *given: [])


@pytest.mark.slow
def test_the_same_seed_gives_the_same_benchmark(compared, no_figures):
    def without_times(found):
        document, _ = found
        for of_model in document["models"].values():
            del of_model["fit_s"]
        return document

    assert without_times(compared("_again")) == without_times(compared())
    assert compared(models="textbook", seed=1)[0]["folds"] != compared()[0]["folds"]


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_the_seed_of_the_configuration_counts_unless_another_is_given(place, compared, said, tmp_path):
    (tmp_path / "seeded.toml").write_text(TINY + "seed = 5\n")

    def seed(*options):
        command = ("benchmark", place / "campaign", "--models", "textbook", "--folds", "2", "--out", tmp_path / "b", "--json", *options)
        document = strict(said(*command)[1])
        assert document["seed"] == document["config"]["seed"]
        return document["seed"]

    assert compared()[0]["seed"] == 0
    assert seed("--config", tmp_path / "seeded.toml") == 5
    assert seed("--config", tmp_path / "seeded.toml", "--seed", 0) == 0


@pytest.mark.parametrize("command", ["train", "benchmark"])
def test_a_place_that_cannot_be_written_to_is_refused_before_the_work(place, said, tmp_path, monkeypatch, command):
    import nnhydro.recordings.campaign as reading

    def worked(*arguments, **keys):
        raise AssertionError("the campaign was opened")

    for opening in ("verify_campaign", "open_campaigns"):
        monkeypatch.setattr(reading, opening, worked)
    (tmp_path / "file").write_text("mine")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.txt").write_text("mine")
    one_line(said(command, place / "campaign", "--out", tmp_path / "file"), "--out", "is a file")
    one_line(said(command, place / "campaign", "--out", tmp_path / "file" / "inside"), "--out", "cannot be made")
    one_line(said(command, place / "campaign", "--out", tmp_path / "full"), "--out", "holds other files")
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "full", "thesis.txt"]


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_the_benchmark_on_the_screen_ends_in_a_verdict(place, said, tmp_path):
    code, out, _ = said("benchmark", place / "campaign", "--models", "constant,textbook", "--out", tmp_path / "b")
    assert code == 0
    assert "On recordings that no fit has seen, constant predicts the torques best" in out


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_a_stored_model_takes_part_unless_it_was_fitted_to_the_campaign(place, model, said, tmp_path):
    command = ("benchmark", place / "campaign", "--models", f"constant,{model}", "--out", tmp_path / "b")
    one_line(said(*command), "has seen 6 of the 6 recordings here", "benchmark it on recordings that it has not seen")
    a = arm(2)
    other = write_folder(campaign(a, planted(a), 2, seconds=3.0, rate=50.0), tmp_path / "other")
    code, out, _ = said("benchmark", other, "--models", f"constant,{model}", "--out", tmp_path / "b", "--json")
    assert code == 0
    assert set(strict(out)["models"]) == {"constant", "model"}


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_steady_tables_alone_can_be_compared(said, tmp_path):
    a = arm(2)
    table = steady_table(a, planted(a), rows=30)
    write_folder(campaign(a, planted(a), 0), tmp_path / "c")
    columns = columns_of(Recording("t", np.arange(30.0), table.q, table.tau, u0=table.u0))
    write_csv(tmp_path / "c" / "steady" / "tows.csv", {name: x for name, x in columns.items() if name != "t_s"})
    code, out, _ = said("benchmark", tmp_path / "c", "--models", "constant,textbook", "--folds", "3", "--out", tmp_path / "b", "--json")
    assert code == 0
    assert strict(out)["models"]["constant"]["error"] < 1e-3


@pytest.mark.parametrize(("arguments", "words"), [
    (("identify", "CAMPAIGN", "--model", "nope", "--out", "OUT"), ("nope", "drag-only")),
    (("identify", "NOWHERE", "--out", "OUT"), ("nowhere", "does not exist")),
    (("identify", "CAMPAIGN"), ("--out",)),
    (("identify", "CAMPAIGN", "--cutoff", "-1", "--out", "OUT"), ("-1",)),
    (("identify", "CAMPAIGN", "--cutoff", "nan", "--out", "OUT"), ("nan",)),
    (("identify", "CAMPAIGN", "--out", "FILE"), ("is a file",)),
    (("identify", "CAMPAIGN", "--out", "CAMPAIGN"), ("holds other files",)),
    (("identify", "CAMPAIGN", "--seed", "-1", "--out", "OUT"), ("seed",)),
    (("train", "CAMPAIGN", "--config", "NOWHERE", "--out", "OUT"), ("nowhere", "cannot be read")),
    (("train", "CAMPAIGN", "--config", "FILE", "--out", "OUT"), ("not valid TOML",)),
    (("predict", "NOWHERE", "MOTION", "--out", "OUT"), ("not a model folder",)),
    (("predict", "CAMPAIGN", "MOTION", "--out", "OUT"), ("not a model folder",)),
    (("predict", "MODEL", "NOWHERE", "--out", "OUT"), ("nowhere",)),
    (("predict", "MODEL", "RECORDINGS", "--out", "OUT"), ("recordings: is a folder", "give its files, as in", "recordings/*.csv")),
    (("predict", "MODEL", "MODEL", "--out", "OUT"), ("is a folder and holds no motion",)),
    (("predict", "MODEL", "CAMPAIGN", "--out", "OUT"), ("is a folder: give its files, as in", "unseen/*.csv")),
    (("identify", "CAMPAIGN", "--model", "constnat", "--out", "OUT"), ("did you mean 'constant'?",)),
    (("predict", "MODEL", "MOTION", "--out", "FILE"), ("cannot be written",)),
    (("benchmark", "CAMPAIGN", "--models", "constant,nope", "--out", "OUT"), ("nope", "hybrid")),
    (("benchmark", "CAMPAIGN", "--models", "constant,constant", "--out", "OUT"), ("twice",)),
    (("benchmark", "CAMPAIGN", "--models", "CAMPAIGN", "--out", "OUT"), ("not a model folder",)),
    (("benchmark", "CAMPAIGN", "--folds", "1", "--out", "OUT"), ("--folds",)),
    (("benchmark", "NOWHERE", "--out", "OUT"), ("does not exist",)),
    (("benchmark", "CAMPAIGN", "--models", "constant", "--seed", "-1", "--out", "OUT"), ("seed",)),
], ids=lambda x: " ".join(x) if isinstance(x, tuple) and len(x) > 2 else None)
def test_a_users_mistake_is_told_in_one_line(arguments, words, place, model, said, tmp_path):
    (tmp_path / "file").write_text("= not ours")
    named = {"CAMPAIGN": place / "campaign", "NOWHERE": tmp_path / "nowhere", "OUT": tmp_path / "out", "FILE": tmp_path / "file",
             "RECORDINGS": place / "campaign" / "recordings", "MODEL": model, "MOTION": place / "campaign" / "unseen" / "motion.csv"}
    one_line(said(*(named.get(a, a) for a in arguments)), *words)
    assert not (tmp_path / "out").exists()
    assert (tmp_path / "file").read_text() == "= not ours"
    assert not list(Path(tmp_path).glob(".*"))


def test_a_single_recording_cannot_be_held_out(said, tmp_path):
    a = arm(1)
    folder = write_folder(campaign(a, planted(a), 1, seconds=1.0), tmp_path / "c")
    one_line(said("benchmark", folder, "--models", "constant", "--out", tmp_path / "b"), "record more")


def test_the_next_command_after_a_fit_to_a_single_recording_works(said, tmp_path):
    a = arm(1)
    folder = write_folder(campaign(a, planted(a), 1, noise=0.02, seconds=2.0), tmp_path / "c")
    code, out, _ = said("identify", folder, "--out", tmp_path / "m")
    assert code == 0
    following = out.partition("Next: nnhydro ")[2].partition("   (")[0]
    assert "benchmark" not in following
    assert said(*following.split(), *(["--out", tmp_path / "next"] if following.startswith("gains") else []))[0] == 0


def test_a_recording_without_a_finite_torque_stretch_does_not_stop_the_others(said, tmp_path):
    a = arm(1)
    folder = write_folder(campaign(a, planted(a), 3, seconds=1.0), tmp_path / "c")
    r = recording(a, planted(a), seed=9, seconds=1.0)
    tau = np.where(np.arange(len(r)) % 5 == 0, np.nan, r.tau[:, 0])
    write_csv(folder / "recordings" / "holes.csv", columns_of(r) | {"tau1_Nm": tau})
    code, out, err = said("benchmark", folder, "--models", "constant", "--folds", "4", "--out", tmp_path / "b", "--json")
    assert code == 0, err
    assert strict(out)["models"]["constant"]["error"] < 1e-6
    assert strict(out)["left_out"] == ["holes"]
    assert "holes" in err
