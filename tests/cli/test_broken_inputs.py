"""Broken inputs, and the one line that each gets: what is wrong, where, and what to do. Never a traceback."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from planted import ARM_YAML, write_campaign

from nnhydro.cli.main import run

# ruff: noqa: E501 - one case a line reads better than one that is wrapped
Break = Callable[[Path], object]
HEADER = "t_s,q1_rad,q2_rad,tau1_Nm,tau2_Nm\n"
ROWS = "".join(f"{i / 100},{i / 50},0,1,{i % 7}\n" for i in range(60))


def file(text: str | bytes, name: str = "recordings/run1.csv") -> Break:
    return lambda root: (root / name).write_bytes(text if isinstance(text, bytes) else text.encode())


def arm(old: str, new: str) -> Break:
    return file(ARM_YAML.replace(old, new, 1), "arm.yaml")


def edited(old: str, new: str) -> Break:
    return file((HEADER + ROWS).replace(old, new, 1))


def gone(root: Path) -> None:
    for path in (root / "recordings").iterdir():
        path.unlink()


def locked(root: Path) -> None:
    (root / "recordings/run1.csv").unlink()
    (root / "recordings/run1.csv").symlink_to(root / "nowhere.csv")


def folder(root: Path) -> None:
    (root / "recordings" / "day2").mkdir()


def twin(root: Path) -> None:
    (root / "recordings/run1.parquet").write_bytes(b"")


# input: how it is broken, what the line says is wrong, what it says to do
BROKEN: dict[str, tuple[Break, str, str]] = {
    "empty file": (file(""), r"run1\.csv: is empty", r"remove the file or record again"),
    "header only": (file(HEADER), r"run1\.csv: holds a header but no rows", r"remove the file or record again"),
    "one row": (file(HEADER + "0,0,0,0,0\n"), r"run1\.csv: holds 1 row: a recording needs at least 4", r"remove the file or record again"),
    "binary junk": (file(bytes(range(256)) * 9), r"run1\.csv: is not UTF-8 text \(byte \d+\)", r"save it as UTF-8"),
    "no header": (file("\n\n\n"), r"run1\.csv: has no header line", r"The first line names the columns, e\.g\. t_s,q1_rad"),
    "missing column": (edited("q2_rad", "q2"), r"column 'q2_rad' is missing, the file has 'q2'", r"say which is which in columns\.yaml .*as in q2_rad: q2$"),
    "column in degrees": (edited("q2_rad", "q2_deg"), r"column 'q2_rad' is missing, the file has 'q2_deg'", r"as in q2_rad: \{from: q2_deg, unit: deg\}$"),
    "missing time": (edited("t_s", "time"), r"column 't_s' is missing, the file has 'time'", r"columns\.yaml beside arm\.yaml .*as in t_s: time$"),
    "foreign names": (file((HEADER + ROWS).replace("t_s,q1_rad", "Time (ms),shoulder")), r"columns 't_s', 'q1_rad' are missing, the file has 'Time \(ms\)', 'shoulder'",
                      r"as in t_s: \{from: Time \(ms\), unit: ms\}$"),
    "name in brackets": (edited("t_s", "t [ms]"), r"column 't_s' is missing, the file has 't \[ms\]'", r'as in t_s: \{from: "t \[ms\]", unit: ms\}$'),
    "bracket unquoted": (file("columns:\n  t_s: {from: t [ms], unit: ms}\n", "columns.yaml"), r"columns\.yaml: is not valid YAML: line 2", r"in quotes"),
    "names in no language": (file((HEADER + ROWS).replace("q1_rad,q2_rad", "a,b")), r"columns 'q1_rad', 'q2_rad' are missing, the file has 'a', 'b'", r"as in q1_rad: ITS NAME$"),
    "duplicate column": (edited("tau2_Nm", "tau1_Nm"), r"column 'tau1_Nm' appears 2 times", r"rename or remove one"),
    "third joint": (edited("tau2_Nm", "tau3_Nm"), r"'tau3_Nm' names joint 3, but arm\.yaml has 2 links", r"add the link to arm\.yaml or remove the column"),
    "text in a cell": (edited("0.05,0.1,", "0.05,oops,"), r"column 'q1_rad', row 7: 'oops' is not a number", r"correct it or leave it empty"),
    "complex number": (edited("0.05,0.1,", "0.05,1+2j,"), r"'q1_rad', row 7: '1\+2j' is not a number", r"correct it or leave it empty"),
    "truth values": (file(HEADER + "".join(f"{i},0,True,0,0\n" for i in range(9))), r"'q2_rad' holds true/false values", r"write plain real numbers"),
    "time of day": (edited("0.05,", "12:00:05,"), r"'t_s', row 7: '12:00:05' is a date or time of day", r"write seconds since the start"),
    "one row too long": (edited("0.05,0.1,", "0.05,0.1,9,"), r"row 7 has 6 fields, the header has 5", r"repair the row"),
    "open quote": (edited("0.05,", '"0.05,'), r"row 7: a quotation mark is opened and never closed", r"remove it"),
    "absurd value": (edited("0.05,0.1,", "0.05,1e30,"), r"'q1_rad', row 7: 1e\+30 is absurd, beyond 1e\+09 \(1 such row of 60\)", r"clear that cell"),
    "empty column": (file(HEADER + "".join(f"{i / 100},{i},,1,1\n" for i in range(60))), r"'q2_rad' holds no finite number", r"it is needed: export the log again with it, or move the file away"),
    "nothing usable": (file(HEADER + "".join(f"{i / 100},{i if i % 3 else ''},0,1,1\n" for i in range(60))),
                       r"run1: its 60 rows hold no stretch free of gaps and empty cells", r"remove the file or record again"),
    "time repeats": (edited("0.05,", "0.04,"), r"t_s, row 7: time repeats .*two logs in one file", r"Split the file there or drop the rows"),
    "time backward": (edited("0.05,", "0.01,"), r"t_s, row 7: time runs backward .*two logs in one file", r"Split the file there or drop the rows"),
    "time in us": (file(HEADER + "".join(f"{i * 10000},{i / 50},0,1,1\n" for i in range(60))), r"in us that would be 100 Hz", r"map it with its unit, 't_s: \{from: t_s, unit: us\}'"),
    "damaged Parquet": (file(b"PAR1junkPAR1", "recordings/x.parquet"), r"x\.parquet: is not a readable Parquet file", r"write it again"),
    "damaged HDF5": (file(b"junk", "recordings/x.h5"), r"x\.h5: is not a readable HDF5 file", r"write it again"),
    "damaged bag": (file(b"junk", "recordings/x.mcap"), r"x\.mcap: is not a readable ROS bag", r"record it again or convert it"),
    "unknown kind of file": (file("hi", "recordings/notes.docx"), r"notes\.docx: is none of \.csv", r"convert it, move it out of recordings/ or start its name with a dot"),
    "folder among the runs": (folder, r"day2: is a folder", r"move its files up into recordings/"),
    "same name twice": (twin, r"run1\.parquet: the name 'run1' is taken by run1\.csv", r"rename one"),
    "broken link": (locked, r"run1\.csv: does not exist", r"check the path"),
    "no runs": (gone, r"holds neither recordings nor steady runs", r"put the logs into recordings/ there, one file per run \(\.csv"),
    "no arm": (lambda root: (root / "arm.yaml").unlink(), r"has no arm\.yaml", r"write one .*or make it from a URDF: nnhydro arm FILE\.urdf --out .*/arm\.yaml$"),
    "unknown key": (arm("length_m", "lenght_m"), r"unknown key 'links\[0\]\.lenght_m'", r"did you mean 'length_m'\? \(and 1 more to mend\)"),
    "missing key": (arm("mass_kg: 1.0, ", ""), r"key 'links\[0\]\.mass_kg' is missing", r"add it"),
    "negative length": (arm("0.55", "-0.55"), r"links\[0\]\.length_m: must be greater than 0, got -0\.55", r"correct it"),
    "word for a number": (arm("0.55", "long"), r"links\[0\]\.length_m: must be a number, got 'long'", r"correct it"),
    "decimal comma": (arm("0.55", "'0,55'"), r"links\[0\]\.length_m: must be a number, got '0,55'", r"write 0\.55$"),
    "decimal comma within braces": (arm("mass_kg: 1.0", "mass_kg: 4,2"), r"line \d+: 4,2 has a decimal comma", r"write 4\.2$"),
    "decimal comma before a zero": (arm("0.026", "0,09"), r"line \d+: 0,09 has a decimal comma", r"write 0\.09$"),
    "a number for a key": (arm("mass_kg: 1.0", "mass_kg: 1.0, 7: 8"), r"must be a word: 'key: value', got 7", r"correct it$"),
    "lengths in mm": (arm("0.55", "550"), r"links\[0\]\.length_m: must be at most 100, got 550", r"probably in mm: write 0\.55$"),
    "no links": (file("fluid: {density_kg_m3: 1000}\nlinks: []\n", "arm.yaml"), r"arm\.yaml: links: must have at least 1 entry, not 0", r"correct it"),
    "fluid is a number": (arm("fluid:", "gear: 5\nfluid:"), r"arm\.yaml: gear: must be a mapping \(key: value\), got 5", r"correct it"),
    "friction of one joint": (arm("links:", "friction: [{coulomb_Nm: 0.1}]\nlinks:"), r"arm\.yaml: friction has 1 entry for 2 joints", r"give one for each, in order"),
    "friction without a unit": (arm("links:", "friction: [{coulomb: 0.1}, {}]\nlinks:"), r"unknown key 'friction\[0\]\.coulomb'", r"did you mean 'coulomb_Nm'\?$"),
    "YAML tag": (arm("links:", "gear: !gear {ratio: 2}\nlinks:"), r"arm\.yaml: is not valid YAML: line \d+: the tag '!gear' is not accepted", r"leave it out and write the plain value$"),
    "YAML tag of an object": (arm("links:", "name: !!timestamp x\nlinks:"), r"the tag '!!timestamp' is not accepted", r"leave it out"),
    "columns are a list": (file("columns: [a]\n", "columns.yaml"), r"columns\.yaml: columns: must be a mapping \(key: value\), got a list", r"correct it"),
    "belt on one link": (arm("fluid:", "drive: {kind: direct, angle2: absolute}\nfluid:"), r"drive: pulley_ratio and angle2: absolute", r"write 'kind: remote', or remove them"),
    "key twice": (arm("links:", "links: []\nlinks:"), r"arm\.yaml: is not valid YAML: line \d+: the key 'links' appears twice", r"remove one"),
    "YAML alias": (arm("links:", "a: &x 1\nb: *x\nlinks:"), r"aliases \(\*name\) are not accepted", r"write the value out"),
    "arm is a list": (file("- 1\n", "arm.yaml"), r"arm\.yaml: holds a list instead of 'key: value' lines", r"is this the right file\?"),
    "mapping of no channel": (file("columns: {q1_deg: a}", "columns.yaml"), r"'q1_deg' is not a channel", r"did you mean 'q1_rad'\?"),
    "unknown unit": (file("columns: {q1_rad: {from: q1_rad, unit: gon}}", "columns.yaml"), r"unit 'gon' for q1_rad is unknown", r"known are rad, mrad, .*for any other give 'scale: \.\.\.'"),
    "mapped column absent": (file("columns: {q1_rad: shoulder}", "columns.yaml"), r"column 'shoulder', mapped to q1_rad, is not there: it has 't_s'", r"correct the name after 'from:'"),
    "steady row incomplete": (lambda root: ((root / "steady").mkdir(), file("q1_rad,q2_rad,tau1_Nm,tau2_Nm\n0,0,1,\n0,0,1,1\n", "steady/a.csv")(root)),
                              r"steady/a\.csv: row 2 .*empty or infinite value", r"remove the row"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_input_gets_one_line_that_says_what_to_do(name: str, tmp_path: Path, capsys):
    breaks, wrong, remedy = BROKEN[name]
    root = write_campaign(tmp_path / "campaign", rows=60)
    breaks(root)
    assert run(["check", str(root)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert err.startswith("nnhydro: error: ")
    said, told = re.search(wrong, err), re.search(remedy, err.strip())
    assert said, err
    assert told, err
    assert said.start() < told.start(), f"what is wrong comes first, what to do last: {err}"
    assert str(tmp_path) in err, "the line names the file"
    assert len(err) < 400, "a line that has to be scrolled is not read"


@pytest.mark.parametrize(("arguments", "line"), [
    (["check", "nowhere"], r"nowhere: does not exist: give the campaign's folder"),
    (["check"], r"[Mm]issing argument"),
    (["check", "campaign/recordings"], r"campaign/recordings: is the folder recordings/ of the campaign .*campaign: give the campaign's folder"),
    (["identify", "campaign/unseen", "--out", "m"], r"campaign/unseen: is the folder unseen/ of the campaign .*: give the campaign's folder"),
    (["check", ".", "--cutoff", "-3"], r"--cutoff -3\.0: give a positive frequency in Hz"),
    (["check", ".", "--map", "nowhere.yaml"], r"nowhere\.yaml: cannot be read|has no arm\.yaml"),
])
def test_a_wrong_call_gets_one_line(arguments: list[str], line: str, tmp_path: Path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_campaign(tmp_path / "campaign", rows=60)
    (tmp_path / "campaign" / "unseen").mkdir(exist_ok=True)
    assert run(arguments) == 2
    assert re.search(line, capsys.readouterr().err)
