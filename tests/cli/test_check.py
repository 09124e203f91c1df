"""`nnhydro check` as a person types it: the table, the findings with what to do, the verdict, JSON, and the exit code."""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from planted import Columns, write_campaign

from nnhydro.cli.main import run
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.survey import errors_of


def backward(c: Columns) -> Mapping[str, np.ndarray]:
    t = c["t_s"].copy()
    t[100:] -= 0.5
    return {"t_s": t}


def in_milliseconds(c: Columns) -> Mapping[str, np.ndarray]:
    return {"t_s": 1e3 * c["t_s"]}


def noted(c: Columns) -> Mapping[str, np.ndarray]:
    return {"u0_m_s": 0 * c["t_s"]}


def test_a_healthy_campaign_is_usable_and_the_next_command_is_named(tmp_path: Path, capsys):
    root = write_campaign(tmp_path / "c")
    assert run(["check", str(root)]) == 0
    out = capsys.readouterr().out
    for word in ("run1", "run2", "q dq tau", "ddq", "L/D", "Reynolds", "Usable: nothing looks wrong.", f"nnhydro benchmark {root}"):
        assert word in out


def test_an_unusable_recording_is_shown_in_full_and_ends_with_one_line(tmp_path: Path, capsys):
    root = write_campaign(tmp_path / "c", backward)
    assert run(["check", str(root)]) == 2
    out, err = capsys.readouterr()
    assert "run1: t_s, row 102: time runs backward" in out
    assert "Not usable: 1 error." in out
    assert err.count("\n") == 1
    assert err.startswith("nnhydro: error: ")
    assert "Split the file there" in err


def test_the_last_line_counts_the_errors_as_the_verdict_does(tmp_path: Path, capsys):
    root = write_campaign(tmp_path / "c", backward, runs=3)
    for number in (2, 3):
        shutil.copy(root / "recordings" / "run1.csv", root / "recordings" / f"run{number}.csv")
    assert run(["check", str(root)]) == 2
    out, err = capsys.readouterr()
    assert "(also in run2, run3)" in out
    assert "Not usable: 1 error." in out
    assert "more)" not in err
    assert len(errors_of(open_campaign(root))) == 1


def test_all_counts_are_those_of_the_lines_that_are_printed(tmp_path: Path, capsys):
    root = write_campaign(tmp_path / "c", runs=3)
    for file in (root / "recordings").iterdir():
        header, *rows = file.read_text().splitlines()
        file.write_text("\n".join([header, *reversed(rows)]) + "\n")
    assert run(["check", str(root)]) == 2
    out, err = capsys.readouterr()
    assert "Not usable: 1 error." in out
    assert " more)" not in err


def test_findings_say_what_to_do(tmp_path: Path, capsys):
    root = write_campaign(tmp_path / "c", in_milliseconds)
    assert run(["check", str(root)]) == 2
    assert "'t_s: {from: t_s, unit: ms}' in columns.yaml or --map FILE" in capsys.readouterr().out


def test_the_remedy_mends_it(tmp_path: Path):
    root = write_campaign(tmp_path / "c", in_milliseconds, runs=1)
    (tmp_path / "map.yaml").write_text("columns: {t_s: {from: t_s, unit: ms}}\n")
    assert run(["check", str(root)]) == 2
    assert run(["check", str(root), "--map", str(tmp_path / "map.yaml")]) == 0


def test_json_is_all_that_stands_on_standard_output(tmp_path: Path, capsys):
    root = write_campaign(tmp_path / "c", noted)
    assert run(["check", str(root), "--json", "--cutoff", "6"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["usable"] is True
    assert [r["name"] for r in document["recordings"]] == ["run1", "run2"]
    assert document["low_pass"]["cutoff_hz"] == 6
    assert [o["check"] for o in document["oddities"]] == ["carriage_at_rest"]
    assert document["links"][0]["slenderness"] == pytest.approx(0.55 / 0.07)


def test_a_folder_of_campaigns_is_checked_arm_by_arm(tmp_path: Path, capsys):
    write_campaign(tmp_path / "a")
    write_campaign(tmp_path / "b", backward)
    assert run(["check", str(tmp_path)]) == 2
    assert str(tmp_path / "b") in capsys.readouterr().err
    assert run(["check", str(tmp_path), "--json"]) == 2
    assert [c["usable"] for c in json.loads(capsys.readouterr().out)["campaigns"]] == [True, False]


def test_a_folder_of_campaigns_ends_with_one_line_over_all_and_names_the_folders_passed_over(tmp_path: Path, capsys):
    write_campaign(tmp_path / "a", lambda c: {"tau2_Nm": 0 * c["t_s"]})
    write_campaign(tmp_path / "b", backward)
    write_campaign(tmp_path / "c")
    write_campaign(tmp_path / "forgotten")
    (tmp_path / "forgotten" / "arm.yaml").unlink()
    assert run(["check", str(tmp_path)]) == 2
    out, err = capsys.readouterr()
    assert out.splitlines()[-1] == "3 campaigns: 1 not usable (b); 1 with warnings (a); 1 usable, where nothing looks wrong (c)."
    assert "passed over, without arm.yaml: forgotten" in err
    assert run(["check", str(tmp_path / "c")]) == 0
    out, err = capsys.readouterr()
    assert " campaigns: " not in out
    assert err == ""


def test_a_campaign_of_steady_tables_alone_is_usable(tmp_path: Path, capsys):
    root = write_campaign(tmp_path / "c")
    for path in (root / "recordings").iterdir():
        path.unlink()
    (root / "steady").mkdir()
    (root / "steady" / "tow.csv").write_text("q1_rad,q2_rad,u0_m_s,tau1_Nm,tau2_Nm\n0,0,0.5,3,1\n0.1,0,0.5,3,1\n")
    assert run(["check", str(root)]) == 0
    assert "Steady table tow: 2 runs." in capsys.readouterr().out


@pytest.mark.parametrize(("column", "severity", "words"), [
    ("carriage [mm/s]", "warning", "the carriage is taken to be at rest"),
    ("water temperature", "note", "nnhydro does not use the column 'water temperature'")])
def test_a_column_that_nobody_reads_is_told_and_a_carriage_among_them_is_a_warning(column, severity, words, tmp_path, capsys):
    root = write_campaign(tmp_path / "campaign")
    for file in (root / "recordings").glob("*.csv"):
        head, *rows = file.read_text().splitlines()
        file.write_text("\n".join([f"{head},{column}", *(f"{row},3.0" for row in rows)]) + "\n")
    assert run(["check", str(root), "--json"]) == 0
    told = [o for o in json.loads(capsys.readouterr().out)["oddities"] if o["check"] == "unused_columns"]
    assert {o["severity"] for o in told} == {severity}
    assert words in told[0]["what"]
    assert column in told[0]["what"]
