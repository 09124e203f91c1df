"""Sealed answers open with their key alone, and a changed or exchanged answer is noticed."""

import json

import pytest
from answers import ANSWER, HEALTHY

from nnhydro.blind_tests.seal import new_key, open_sealed, read_key, seal, write_key, write_sealed
from nnhydro.errors import ConfigError


def test_a_sealed_answer_opens_with_its_key_alone(tmp_path):
    key, path = new_key(), tmp_path / "campaign_000.sealed"
    write_sealed(path, seal("campaign_000", ANSWER, key))
    assert open_sealed(path, key) == ANSWER
    assert "umbilical" not in path.read_text()
    assert b"umbilical" not in bytes.fromhex(json.loads(path.read_text())["text"])
    with pytest.raises(ConfigError, match="not its key"):
        open_sealed(path, new_key())


def test_a_changed_or_exchanged_answer_is_noticed(tmp_path):
    key, path = new_key(), tmp_path / "campaign_000.sealed"
    first = seal("campaign_000", ANSWER, key)
    write_sealed(path, first)
    document = json.loads(path.read_text())
    flipped = ("1" if document["text"][9] != "1" else "2").join([document["text"][:9], document["text"][10:]])
    path.write_text(json.dumps({**document, "text": flipped}))
    with pytest.raises(ConfigError, match="was changed"):
        open_sealed(path, key)
    write_sealed(path, seal("campaign_000", HEALTHY, key))
    with pytest.raises(ConfigError, match="committed itself to"):
        open_sealed(path, key, first.commitment)
    write_sealed(path, seal("campaign_001", ANSWER, key))
    with pytest.raises(ConfigError, match="exchanged"):
        open_sealed(path, key)


def test_the_same_answer_gives_the_same_seal_and_another_campaign_another():
    key = bytes(32)
    assert seal("a", ANSWER, key) == seal("a", ANSWER, key)
    assert seal("a", ANSWER, key).text[:40] != seal("b", ANSWER, key).text[:40]


@pytest.mark.parametrize("text", ["", "deadbeef", "x" * 64])
def test_a_file_that_holds_no_key_is_refused(tmp_path, text):
    (tmp_path / "key.txt").write_text(text)
    with pytest.raises(ConfigError, match="64 hexadecimal digits"):
        read_key(tmp_path / "key.txt")


def test_a_key_is_for_its_owner_alone(tmp_path):
    write_key(tmp_path / "key.txt", bytes(range(32)))
    assert (tmp_path / "key.txt").stat().st_mode & 0o077 == 0
    assert read_key(tmp_path / "key.txt") == bytes(range(32))
