"""Models survive their folder to the last bit, and a folder that is not ours, or was changed, is refused in one line."""

import json
import pickle
from functools import cache

import pytest
import torch
from campaigns import DEFAULT_LAWS, GIVEN, TINY, campaign, planted
from rigs import arm, run, states
from strip_nets import remembering

from nnhydro.errors import ConfigError, ModelError
from nnhydro.fitting.identify import identify
from nnhydro.fitting.network.train import train
from nnhydro.models.storage import DIGEST, MODEL, WEIGHTS, _digest, load_model, save_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.runtime.stamp import STAMP


def whole(a=None):
    return campaign(a or arm(2), planted(a or arm(2)), 3, noise=0.02, seconds=1.0, rate=50.0)


@cache
def made(kind):
    """A model of each kind; a learned one has the laws that a training takes by default."""
    if kind == "strip theory":
        return identify(whole())
    if kind.endswith(" with a trained memory"):
        return remembering(made(kind.partition(" ")[0]))
    return train(whole(), DEFAULT_LAWS.model_copy(update={"model": kind, "epochs": 1}))


KINDS = pytest.mark.parametrize("kind", ["strip theory", "network", "hybrid", "hybrid with a trained memory",
                                         "network with a trained memory"])


@KINDS
def test_a_stored_model_gives_the_same_torques_to_the_last_bit(kind, tmp_path):
    model = made(kind)
    assert save_model(model, tmp_path / "model") == tmp_path / "model"
    again = load_model(tmp_path / "model")
    for motion in (run(2), states(2)):
        assert torch.equal(again.torque(motion), model.torque(motion))
    assert again.arm.document() == model.arm.document()
    assert (again.preparation, again.fit, again.kind) == (model.preparation, model.fit, model.kind)
    assert again.document() == model.document()


def test_a_reader_that_knows_no_trained_memory_refuses_a_model_that_holds_one(tmp_path):
    plain, folder = made("hybrid"), save_model(made("hybrid with a trained memory"), tmp_path / "model")
    assert load_model(folder).document()["bank"] != plain.document()["bank"]  # what readers compare with their own
    document = json.loads((folder / MODEL).read_text())
    document["model"]["bank"] = plain.document()["bank"]
    (folder / MODEL).write_text(json.dumps(document))
    (folder / DIGEST).write_text(_digest(folder) + "\n")
    with pytest.raises(ModelError, match="remembered their motion in another way"):
        load_model(folder)


@pytest.mark.parametrize("keys", [{"drive": {"kind": "remote", "pulley_ratio": 1.5}}, {"gravity_m_s2": 9.81},
                                  {"gear": {"ratio": 25.0, "efficiency": 0.8, "torque_at": "motor"}}], ids=str)
def test_belts_gears_and_gravity_are_stored(keys, tmp_path):
    a = arm(2, **keys)
    model = StripTheory(a, Preparation(LowPass(7.25), "qd"), {}, "constant", planted(a))
    again = load_model(save_model(model, tmp_path / "model"))
    assert again.arm.document() == a.document()
    assert again.preparation == model.preparation
    assert torch.equal(again.torque(run(2)), model.torque(run(2)))


@KINDS
def test_the_document_is_strict_json(kind, tmp_path):
    folder = save_model(made(kind), tmp_path / "model")

    def refuse(constant):
        raise AssertionError(constant)

    document = json.loads((folder / MODEL).read_text(), parse_constant=refuse)
    assert document["schema"] == "nnhydro/model/1"
    assert {"kind", "arm", "preparation", "model", "fit"} <= set(document)
    assert {p.name for p in folder.iterdir()} == {MODEL, DIGEST, STAMP} | ({WEIGHTS} if kind != "strip theory" else set())


def test_an_existing_model_is_replaced_and_nothing_else_is_left(tmp_path):
    save_model(made("network"), tmp_path / "model")
    model = made("strip theory")
    folder = save_model(model, tmp_path / "model")
    assert torch.equal(load_model(folder).torque(run(2)), model.torque(run(2)))
    assert not (folder / WEIGHTS).exists()
    assert [p.name for p in tmp_path.iterdir()] == ["model"]


def test_a_folder_of_somebodys_own_files_is_not_replaced(tmp_path):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter1.tex").write_text("precious")
    with pytest.raises(ConfigError, match="holds other files"):
        save_model(made("strip theory"), tmp_path / "thesis")
    assert (tmp_path / "thesis" / "chapter1.tex").read_text() == "precious"


def refused(folder, match):
    """Loading fails in one line that names the folder."""
    with pytest.raises(ModelError, match=match) as caught:
        load_model(folder)
    assert str(folder) in str(caught.value)
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize("name", [MODEL, WEIGHTS, DIGEST])
def test_a_folder_that_was_changed_is_refused(name, tmp_path):
    folder = save_model(made("network"), tmp_path / "model")
    content = bytearray((folder / name).read_bytes())
    content[len(content) // 2] ^= 1
    (folder / name).write_bytes(content)
    refused(folder, "changed after the model was written")


@pytest.mark.parametrize("name", [WEIGHTS, DIGEST])
def test_a_folder_with_a_file_missing_is_refused(name, tmp_path):
    folder = save_model(made("network"), tmp_path / "model")
    (folder / name).unlink()
    refused(folder, "do not match")


def test_what_is_no_model_folder_is_refused_with_what_to_do(tmp_path):
    refused(tmp_path / "nowhere", "not a model folder")
    (tmp_path / "file").write_text("x")
    refused(tmp_path / "file", "not a model folder")
    refused(tmp_path, "nnhydro identify, train")


def rewritten(folder, change):
    """The model's folder with its document changed and the digest made to fit."""
    document = json.loads((folder / MODEL).read_text())
    change(document)
    (folder / MODEL).write_text(json.dumps(document))
    (folder / DIGEST).write_text(_digest(folder) + "\n")


@pytest.mark.parametrize(("change", "said"), [
    (lambda d: d.update(schema="nnhydro/model/99"), "model/99"),
    (lambda d: d.update(kind="oracle"), "oracle"),
    (lambda d: d.pop("arm"), "arm"),
    (lambda d: d.update(preparation=[1]), "understood"),
    (lambda d: d.update(fit=None), "understood"),
    (lambda d: d["arm"]["links"][0].update(length_m=-1), "length_m"),
    (lambda d: d["model"].update(terms=[]), "understood"),
    (lambda d: d["model"].update(name="x\x1b[2J"), "printable"),
    (lambda d: d["model"].update(name="x\ny"), "printable"),
    (lambda d: d["model"].update(name="x" * 201), "printable"),
    (lambda d: d["model"].update(name=7), "printable"),
    (lambda d: d["arm"].update(name="x\ny"), "control character"),
    (lambda d: d["model"]["terms"]["normal_drag"].update(kind="magic"), "magic"),
    (lambda d: d["model"]["terms"]["normal_drag"]["parameters"].update(C_D=[1.0]), "understood"),
    (lambda d: d["model"]["terms"]["normal_drag"]["parameters"].update(C_D=[float("nan"), 1.0]), "NaN"),
    (lambda d: d["preparation"].update(low_pass={"cutoff_hz": -1, "order": 4}), "cut-off"),
])
def test_a_document_that_makes_no_sense_is_refused_even_with_a_fitting_digest(change, said, tmp_path):
    folder = save_model(made("strip theory"), tmp_path / "model")
    rewritten(folder, change)
    refused(folder, said)


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "\x00\x01", "[" * 100_000])
def test_junk_instead_of_a_document_is_refused(text, tmp_path):
    folder = save_model(made("strip theory"), tmp_path / "model")
    (folder / MODEL).write_text(text)
    (folder / DIGEST).write_text(_digest(folder) + "\n")
    refused(folder, "JSON|schema")


def test_pickled_weights_are_never_opened(tmp_path):
    folder = save_model(made("network"), tmp_path / "model")

    class Bomb:
        def __reduce__(self):
            return (print, ("executed",))

    for content in (pickle.dumps(Bomb()), b"", b"\xff" * 1000):
        (folder / WEIGHTS).write_bytes(content)
        (folder / DIGEST).write_text(_digest(folder) + "\n")
        refused(folder, "understood")


@pytest.mark.slow
def test_weights_of_another_layout_are_refused(tmp_path):
    folder = save_model(made("network"), tmp_path / "model")
    other = save_model(train(whole(arm(1)), TINY.model_copy(update={"epochs": 1})), tmp_path / "other")
    (folder / WEIGHTS).write_bytes((other / WEIGHTS).read_bytes())
    (folder / DIGEST).write_text(_digest(folder) + "\n")
    refused(folder, "understood")


def test_a_network_of_an_earlier_layout_is_refused_with_what_to_do(tmp_path):
    folder = save_model(made("network"), tmp_path / "model")
    document = json.loads((folder / MODEL).read_text())
    del document["model"]["law"]
    (folder / MODEL).write_text(json.dumps(document))
    (folder / DIGEST).write_text(_digest(folder) + "\n")
    refused(folder, "train it again on its recordings")


def test_a_digest_that_is_no_text_is_refused(tmp_path):
    folder = save_model(made("strip theory"), tmp_path / "model")
    (folder / DIGEST).write_bytes(b"\xff\xfe\x00")
    refused(folder, "do not match")


def test_a_model_needs_nothing_but_its_folder(tmp_path):
    moved = (save_model(StripTheory(arm(1), GIVEN, {}, "constant", planted(arm(1))), tmp_path / "a" / "b" / "model")).rename(tmp_path / "m")
    assert load_model(moved).arm.document() == arm(1).document()
