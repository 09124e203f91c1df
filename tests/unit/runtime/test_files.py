"""Files and folders appear whole or not at all."""

import json
import math
import stat

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nnhydro.errors import ConfigError
from nnhydro.runtime.files import check_folder, comment_text, json_text, whole_folder, write_json, write_text
from nnhydro.runtime.stamp import STAMP


def names(folder):  # but for the list of what was written
    return sorted(p.name for p in folder.iterdir() if p.name != STAMP)


def test_text_is_written_and_its_folder_made(tmp_path):
    write_text(tmp_path / "a" / "b.txt", "Grüße\n")
    assert (tmp_path / "a" / "b.txt").read_text(encoding="utf-8") == "Grüße\n"
    assert names(tmp_path / "a") == ["b.txt"]
    assert stat.S_IMODE((tmp_path / "a" / "b.txt").stat().st_mode) == 0o644


def test_a_failed_write_leaves_the_old_text_and_nothing_else(tmp_path):
    write_text(tmp_path / "b.txt", "old")
    with pytest.raises(UnicodeEncodeError):
        write_text(tmp_path / "b.txt", "new \ud800")
    assert (tmp_path / "b.txt").read_text() == "old"
    assert names(tmp_path) == ["b.txt"]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_json_knows_no_nan_and_no_infinity(value, tmp_path):
    with pytest.raises(ValueError, match="JSON"):
        write_json(tmp_path / "x.json", {"a": value})
    assert names(tmp_path) == []
    assert json.loads(json_text({"a": [1, None, "é"]})) == {"a": [1, None, "é"]}


def test_a_folder_appears_whole(tmp_path):
    with whole_folder(tmp_path / "deep" / "out", "mark") as work:
        (work / "x").write_text("1")
        assert not (tmp_path / "deep" / "out").exists()
    assert names(tmp_path / "deep" / "out") == ["mark", "x"]
    assert names(tmp_path / "deep") == ["out"]
    assert stat.S_IMODE((tmp_path / "deep" / "out").stat().st_mode) == 0o755


def made(out, text):
    with whole_folder(out, "mark") as work:
        (work / text).write_text(text)
    return out


def test_a_folder_of_ours_is_replaced_whole(tmp_path):
    made(tmp_path / "out", "old")
    made(tmp_path / "out", "new")
    assert names(tmp_path / "out") == ["mark", "new"]
    assert names(tmp_path) == ["out"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_failure_inside_leaves_the_old_folder_and_nothing_else(tmp_path, error):
    made(tmp_path / "out", "old")

    def fail():
        with whole_folder(tmp_path / "out", "mark") as work:
            (work / "half").write_text("half")
            raise error

    with pytest.raises(error):
        fail()
    assert names(tmp_path / "out") == ["mark", "old"]
    assert names(tmp_path) == ["out"]


def test_a_failure_inside_leaves_nothing_where_nothing_was(tmp_path):
    with pytest.raises(ValueError), whole_folder(tmp_path / "out", "mark"):
        raise ValueError
    assert names(tmp_path) == []


def test_an_empty_folder_is_taken(tmp_path):
    (tmp_path / "out").mkdir()
    assert names(made(tmp_path / "out", "new")) == ["mark", "new"]


def test_a_folder_of_others_and_a_file_are_refused_before_any_work(tmp_path):
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "notes").write_text("mine")
    (tmp_path / "file").write_text("mine")
    for out, said in (("theirs", "holds other files"), ("file", "is a file"), ("file/below", "cannot be made")):
        with pytest.raises(ConfigError, match=said), whole_folder(tmp_path / out, "mark"):
            pytest.fail("the block must not run")
    assert names(tmp_path) == ["file", "theirs"]
    assert (tmp_path / "theirs" / "notes").read_text() == "mine"


def test_a_place_is_checked_without_being_touched(tmp_path):
    check_folder(tmp_path / "deep" / "out", "mark")
    assert names(tmp_path) == []
    (tmp_path / "file").touch()
    for wrong, said in ((tmp_path / "file", "is a file"), (tmp_path / "file" / "out", "cannot be made"), (tmp_path, "holds other files")):
        with pytest.raises(ConfigError, match=said):
            check_folder(wrong, "mark")


@given(st.text(alphabet="*/-<>! \\\n\x1b?a", max_size=12))
def test_no_text_holds_what_begins_or_ends_a_comment(text):
    made = comment_text(text)
    assert not any(mark in made for mark in ("*/", "/*", "--", "\x1b"))
    assert made.replace(" ", "").replace("\N{REPLACEMENT CHARACTER}", "\x1b") == text.replace(" ", ""), "nothing is lost"


@pytest.mark.parametrize("text", ["C_D(s/D) of 3 - 4 strips", "a*b"])
def test_plain_text_stays_as_it_is(text):
    assert comment_text(text) == text
