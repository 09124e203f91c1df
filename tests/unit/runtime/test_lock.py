"""One run at a time into a place, and what a killed one leaves is removed by the next."""

import os
import signal

import pytest
from planted import write_campaign

import nnhydro.runtime.files as files
from nnhydro.cli.main import run
from nnhydro.runtime.files import UNDER_WAY, remove_leftovers, whole_folder, write_text
from nnhydro.runtime.lock import BusyError, only_run
from nnhydro.runtime.stamp import STAMP


def names(folder):
    return sorted(p.name for p in folder.iterdir())


def in_child(work):
    """Do `work` in a child process, which then kills itself; returns when it is dead."""
    pid = os.fork()
    if not pid:
        try:
            work()
        finally:
            os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(pid, 0)


def test_a_second_run_into_the_same_place_is_refused(tmp_path):
    with only_run(tmp_path / "out"), pytest.raises(BusyError, match="another nnhydro is at work there"), only_run(tmp_path / "out"):
        pytest.fail("both run")
    with only_run(tmp_path / "out"):
        pass
    assert names(tmp_path) == []


def test_two_places_side_by_side_do_not_disturb_each_other(tmp_path):
    with only_run(tmp_path / "one"), only_run(tmp_path / "two"):
        assert names(tmp_path) == [".one.lock", ".two.lock"]


def test_a_lock_that_a_killed_run_left_holds_nothing(tmp_path):
    in_child(only_run(tmp_path / "out").__enter__)
    assert names(tmp_path) == [".out.lock"]
    with only_run(tmp_path / "out"):
        pass
    assert names(tmp_path) == []


def test_folders_made_for_the_lock_alone_vanish(tmp_path):
    with only_run(tmp_path / "a" / "b" / "out"):
        pass
    assert names(tmp_path) == []


def test_a_place_that_cannot_hold_a_lock_is_left_to_the_command(tmp_path):
    (tmp_path / "file").touch()
    with only_run(tmp_path / "file" / "out"):
        assert names(tmp_path) == ["file"]


def test_a_command_says_that_another_is_at_work(tmp_path, capsys):
    root = write_campaign(tmp_path / "c")
    with only_run(tmp_path / "model"):
        assert run(["identify", str(root), "--model", "textbook", "--out", str(tmp_path / "model")]) == 2
    assert "wait until it has finished, or name another place" in capsys.readouterr().err


def test_what_a_killed_run_left_is_removed_and_what_a_running_one_holds_stays(tmp_path):
    def die_inside():
        with whole_folder(tmp_path / "out", "mark") as work:
            (work / "half").write_text("half")
            os.kill(os.getpid(), signal.SIGKILL)

    in_child(die_inside)
    assert len(names(tmp_path)) == 1
    (tmp_path / ".out.notes").write_text("somebody's own")
    with whole_folder(tmp_path / "other", "mark") as work:
        (work / "x").write_text("x")
        remove_leftovers(tmp_path)
    assert names(tmp_path) == [".out.notes", "other"]
    assert names(tmp_path / "other") == [STAMP, "mark", "x"]


def test_a_replacement_killed_between_two_renames_loses_nothing(tmp_path, monkeypatch):
    def made(text):
        with whole_folder(tmp_path / "out", "mark") as work:
            (work / text).write_text(text)

    made("old")
    monkeypatch.setattr(files, "_exchange", lambda one, other: False)  # a file system where folders cannot change places
    replace = os.replace

    def dying(source, target):
        if str(target) == str(tmp_path / "out"):
            os.kill(os.getpid(), signal.SIGKILL)
        replace(source, target)

    def die():
        monkeypatch.setattr(os, "replace", dying)
        made("new")

    in_child(die)
    assert not (tmp_path / "out").exists()
    remove_leftovers(tmp_path)
    assert names(tmp_path) == ["out"]
    assert names(tmp_path / "out") == [STAMP, "mark", "old"]
    made("new")
    assert names(tmp_path / "out") == [STAMP, "mark", "new"]
    assert names(tmp_path) == ["out"]


def test_a_replaced_folder_is_there_at_every_moment(tmp_path, monkeypatch):
    if not hasattr(os, "fork") or os.uname().sysname != "Linux":
        pytest.skip("folders change places in one step on Linux alone")
    seen = []
    replace = os.replace
    monkeypatch.setattr(os, "replace", lambda a, b: (seen.append((tmp_path / "out").exists()), replace(a, b))[1])
    for text in ("old", "new"):
        with whole_folder(tmp_path / "out", "mark") as work:
            (work / text).write_text(text)
    assert seen == [False], "only the first is renamed; the second changed places with it"


@pytest.mark.parametrize("mode", [0o600, 0o644])
def test_nobody_can_read_a_key_while_it_is_written(mode, tmp_path, monkeypatch):
    modes = []
    write = files.os.fsync
    monkeypatch.setattr(files.os, "fsync", lambda handle: (modes.append(os.fstat(handle).st_mode & 0o777), write(handle))[1])
    write_text(tmp_path / "key", "secret", mode)
    assert modes == [0o600]
    assert (tmp_path / "key").stat().st_mode & 0o777 == mode


def test_a_half_written_file_has_a_hidden_name_that_is_known_as_ours(tmp_path, monkeypatch):
    monkeypatch.setattr(files.os, "fsync", lambda handle: os.kill(os.getpid(), signal.SIGKILL))
    in_child(lambda: write_text(tmp_path / "result.json", "x" * 100))
    (left,) = names(tmp_path)
    assert left.startswith(f".result.json{UNDER_WAY}")
    remove_leftovers(tmp_path)
    assert names(tmp_path) == []
