"""What commands print."""

from pathlib import Path

from nnhydro.cli.terminal import output


def test_units_in_brackets_survive_in_headings(capsys):
    output.table("time [s]", ["fit [s]", "[bold]"], [["[red]1", "2"]])
    out = capsys.readouterr().out
    for text in ("time [s]", "fit [s]", "[bold]", "[red]1"):
        assert text in out


def test_a_verdict_is_said_though_all_else_is_hushed(capsys, monkeypatch):
    monkeypatch.setattr(output, "_quiet", True)
    output.say("a table")
    output.note("a step")
    output.table("title", ["a"], [["1"]])
    output.conclude("Done.", [Path("out.json")], "nnhydro check tank")
    shown = capsys.readouterr()
    assert shown.out == "Done.\n"
    assert shown.err == ""


def test_a_command_ends_with_verdict_files_and_what_comes_next(capsys, monkeypatch):
    monkeypatch.setattr(output, "_quiet", False)
    output.conclude("Done.", [Path("out.json")], "nnhydro check tank")
    assert capsys.readouterr().out == "Done.\n  out.json\nNext: nnhydro check tank\n"


def test_a_path_is_quoted_as_a_shell_needs_it_with_the_mapping_it_was_read_by():
    assert output.shell_words(Path("my tank")) == "'my tank'"
    assert output.shell_words(Path("tank"), Path("my map.yaml")) == "tank --map 'my map.yaml'"


def test_a_model_is_used_on_unseen_motions_where_there_are_any(tmp_path):
    assert output.use_of(Path("m"), tmp_path).startswith("nnhydro gains m")
    (tmp_path / "unseen").mkdir()
    (tmp_path / "unseen" / ".DS_Store").touch()
    assert output.use_of(Path("m"), tmp_path).startswith("nnhydro gains m")
    (tmp_path / "unseen" / "a.csv").touch()
    assert output.use_of(Path("m"), tmp_path) == f"nnhydro predict m {output.shell_words(tmp_path / 'unseen')}/*.csv --out torques"


def test_a_single_recording_leaves_nothing_to_hold_out():
    assert output.nothing_to_hold_out(1, 0)
    assert not output.nothing_to_hold_out(1, 1)
    assert not output.nothing_to_hold_out(2, 0)


def test_the_points_of_a_domain_fill_no_pages():
    assert output.without_bulk({"model": "constant", "domain": [1, 2, 3]}) == {"model": "constant"}
