"""Model files carry no code: no pickle anywhere, every change is noticed, another version says which one reads it; answers stay sealed."""

import ast
import json
import random
import zlib
from pathlib import Path

import pytest
from campaigns import GIVEN, planted
from rigs import arm

from nnhydro.blind_tests.seal import open_sealed, read_key, seal, write_key, write_sealed
from nnhydro.errors import ConfigError, ModelError
from nnhydro.models.storage import DIGEST, MODEL, _digest, load_model, save_model
from nnhydro.models.strip_theory import StripTheory

ROOT = Path(__file__).resolve().parent.parent.parent
SOURCES = sorted((ROOT / "nnhydro").rglob("*.py"))
CODE_IN_DATA = {"pickle", "cPickle", "dill", "cloudpickle", "shelve", "marshal", "jsonpickle", "xmlrpc"}
CALLS = {("torch", "load"), ("torch", "save"), ("joblib", "load"), ("joblib", "dump"), ("yaml", "load_all"), ("yaml", "unsafe_load"),
         ("yaml", "full_load"), ("os", "system"), ("os", "popen"), ("pd", "read_pickle"), ("pandas", "read_pickle")}
COMPILES = {"nnhydro/deployment/compiled/engines.py"}  # text made from a trace of our own terms, never from a file
ANSWER = {"kind": "effect", "effects": [{"effect": "payload_mass"}], "secret": "0123456789"}


def calls(path):
    """(owner, name, keywords) of every call in the file; owner is "" for a plain name."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            owner = node.func.value.id if isinstance(node.func, ast.Attribute) and isinstance(node.func.value, ast.Name) else ""
            name = node.func.attr if isinstance(node.func, ast.Attribute) else node.func.id if isinstance(node.func, ast.Name) else ""
            yield owner, name, {k.arg: k.value for k in node.keywords}


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_file_is_read_that_can_hold_code(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        assert not {name.split(".")[0] for name in names} & CODE_IN_DATA
    for owner, name, keywords in calls(path):
        assert (owner, name) not in CALLS, f"{owner}.{name}"
        assert "allow_pickle" not in keywords
        if (owner, name) == ("yaml", "load"):
            assert path.name == "yaml_file.py", "YAML goes through read_yaml, which refuses aliases and tags"
        if not owner and name in ("eval", "exec", "__import__"):
            assert str(path.relative_to(ROOT)) in COMPILES


def stored(folder):
    return save_model(StripTheory(arm(2), GIVEN, {}, "constant", planted(arm(2))), folder)


def test_any_flipped_bit_is_noticed(tmp_path):
    folder, rng = stored(tmp_path / "m"), random.Random(3)
    for name in (MODEL, DIGEST):
        whole = (folder / name).read_bytes()
        for _ in range(40):
            changed = bytearray(whole)
            changed[rng.randrange(len(whole) - 1)] ^= 1 << rng.randrange(8)
            (folder / name).write_bytes(changed)
            with pytest.raises(ModelError, match="changed after the model was written"):
                load_model(folder)
        (folder / name).write_bytes(whole)
    load_model(folder)


@pytest.mark.parametrize(("schema", "said"), [("nnhydro/model/2", "a later version of nnhydro wrote it: update nnhydro"),
                                              ("nnhydro/model/0", "make the model again"), ("keras", "was this written by nnhydro"),
                                              (7, "was this written by nnhydro"), (None, "was this written by nnhydro")])
def test_a_model_of_another_version_says_which_one_reads_it(schema, said, tmp_path):
    folder = stored(tmp_path / "m")
    document = json.loads((folder / MODEL).read_text()) | {"schema": schema}
    (folder / MODEL).write_text(json.dumps(document))
    (folder / DIGEST).write_text(_digest(folder) + "\n")
    with pytest.raises(ModelError, match=rf"nnhydro \S+ reads 'nnhydro/model/1'; .*{said}"):
        load_model(folder)


def test_the_model_that_ships_with_the_tests_is_still_read():
    model = load_model(Path(__file__).parent / "model_1")
    assert model.arm.n_links == 2


def test_a_sealed_answer_shows_nothing_without_its_key(tmp_path):
    key, path = bytes(range(32)), tmp_path / "campaign_000.sealed"
    write_sealed(path, seal("campaign_000", ANSWER, key))
    text = path.read_bytes()
    inside = bytes.fromhex(json.loads(text)["text"])
    for word in (b"payload", b"secret", b"effect", b"0123456789"):
        assert word not in text
        assert word not in inside
    with pytest.raises(zlib.error):
        zlib.decompress(inside)
    for number in range(64):
        other = bytearray(key)
        other[number // 2] ^= 1 << (number % 8)
        with pytest.raises(ConfigError, match="this is not its key"):
            open_sealed(path, bytes(other))
    assert open_sealed(path, key) == ANSWER


@pytest.mark.parametrize("part", ["iv", "tag", "text", "commitment", "name"])
def test_a_changed_answer_is_noticed(part, tmp_path):
    key, path = bytes(range(32)), tmp_path / "campaign_000.sealed"
    document = seal("campaign_000", ANSWER, key).document()
    first = document[part][0]
    path.write_text(json.dumps(document | {part: ("0" if first != "0" else "1") + document[part][1:]}))
    with pytest.raises(ConfigError, match=r"cannot be opened|sealed again|exchanged"):
        open_sealed(path, key)


def test_two_answers_under_one_key_share_no_bytes():
    key = bytes(range(32))
    one, other = (seal(name, ANSWER, key) for name in ("campaign_000", "campaign_001"))
    assert one.iv != other.iv
    assert one.text[:16] != other.text[:16]


def test_a_key_is_read_by_its_owner_alone(tmp_path):
    write_key(tmp_path / "key.txt", bytes(32))
    assert (tmp_path / "key.txt").stat().st_mode & 0o077 == 0
    assert read_key(tmp_path / "key.txt") == bytes(32)
