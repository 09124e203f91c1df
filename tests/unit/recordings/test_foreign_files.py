"""Files as other people's loggers and spreadsheets write them are read, and what was made of them is said."""

import numpy as np
import pytest
import yaml
from campaigns import campaign, planted, write_folder
from rigs import arm

from nnhydro.cli.main import run
from nnhydro.errors import RecordingError
from nnhydro.models.prediction import predict
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.readers.from_columns import spread_stamps
from nnhydro.recordings.survey import survey

A = arm(1)
T = np.round(np.arange(200) * 0.01, 3)
Q, TAU = 0.3 * np.sin(2 * T), 0.5 * np.cos(2 * T)
NAMES = ("t_s", "q1_rad", "tau1_Nm")


def table(delimiter=",", decimal=".", names=NAMES, times=None, below=(), digits=9):
    """The recording as text."""
    def cell(x):
        return f"{x:.{digits}f}".replace(".", decimal)

    stamps = [cell(t) for t in T] if times is None else times
    rows = [[t, cell(q), cell(tau)] for t, q, tau in zip(stamps, Q, TAU, strict=True)]
    return "\n".join(delimiter.join(row) for row in (names, *below, *rows)) + "\n"


def got(path, content):
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    r = read_recording(path, A)
    np.testing.assert_allclose(r.t - r.t[0], T, atol=1e-6)
    np.testing.assert_allclose(r.q[:, 0], Q, atol=1e-8)
    np.testing.assert_allclose(r.tau[:, 0], TAU, atol=1e-8)
    return r


def stamp(style):
    import pandas as pd

    when = pd.Timestamp("2024-05-03 23:59:59.200") + pd.to_timedelta(T, unit="s")
    return {"ISO": [x.isoformat() for x in when], "ISO in UTC": [x.isoformat() + "Z" for x in when],
            "ISO, blank": [str(x) for x in when], "day first": [x.strftime("%d.%m.%Y %H:%M:%S,%f")[:-3] for x in when],
            "slashes": [x.strftime("%d/%m/%Y %H:%M:%S.%f")[:-3] for x in when],
            "time of day past midnight": [x.strftime("%H:%M:%S.%f") for x in when]}[style]


TEXTS = {
    "German: semicolons and decimal commas": ("a.csv", table(";", ","), "decimal commas"),
    "tabs and decimal commas": ("a.txt", table("\t", ","), "decimal commas"),
    "quoted decimal commas between commas": ("a.csv", "t_s,q1_rad,tau1_Nm\n" + "".join(
        '"' + '","'.join(f"{x:.9f}".replace(".", ",") for x in row) + '"\n' for row in zip(T, Q, TAU, strict=True)), "decimal commas"),
    "tab-separated .tsv": ("a.tsv", table("\t"), ""),
    "blanks in .txt": ("a.txt", table("   "), ""),
    "UTF-16 from a spreadsheet": ("a.csv", table("\t").encode("utf-16"), "text in utf-16"),
    "UTF-16 without a mark": ("a.csv", table("\t").encode("utf-16-le"), "text in utf-16-le"),
    "UTF-8 with a mark": ("a.csv", table().encode("utf-8-sig"), ""),
    "Windows letters": ("a.csv", (table(";", ",", (*NAMES[:2], "tau1_Nm;Prüfstände für Öl und Kühlung"), digits=9)
                                  .replace("\n", ";ä\n").replace("Kühlung;ä", "Kühlung")).encode("cp1252"), "text in"),
    "a row of units": ("a.csv", table(below=[("s", "rad", "Nm")]), "units from the row below the header"),
    "a row of units in brackets, German": ("a.csv", table(";", ",", below=[("[s]", "[rad]", "[Nm]")]), "units from the row"),
    "ISO timestamps": ("a.csv", table(times=stamp("ISO")), "t_s: dates and times of day in seconds since the first row"),
    "ISO timestamps in UTC": ("a.csv", table(times=stamp("ISO in UTC")), "dates and times of day"),
    "ISO timestamps with a blank": ("a.csv", table(times=stamp("ISO, blank")), "dates and times of day"),
    "local timestamps, day first": ("a.csv", table(";", ",", times=stamp("day first")), "dates and times of day"),
    "local timestamps with slashes": ("a.csv", table(times=stamp("slashes")), "dates and times of day"),
    "times of day past midnight": ("a.csv", table(times=stamp("time of day past midnight")), "dates and times of day"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_it_is_read_and_said(name, tmp_path):
    file, content, said = TEXTS[name]
    r = got(tmp_path / file, content)
    assert said in "; ".join(r.steps)


def test_a_row_of_units_is_applied(tmp_path):
    degrees = table(below=[("ms", "deg", "N cm")])
    (tmp_path / "a.csv").write_text(degrees)
    r = read_recording(tmp_path / "a.csv", A)
    np.testing.assert_allclose(r.t, T / 1000, atol=1e-9)
    np.testing.assert_allclose(r.q[:, 0], np.radians(Q), atol=1e-9)
    np.testing.assert_allclose(r.tau[:, 0], TAU / 100, atol=1e-9)
    assert "q1_rad" in r.origin.stated


def test_a_row_of_units_serves_foreign_columns_too(tmp_path):
    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / "a.csv").write_text(table(";", ",", ("Zeit", "Winkel", "Moment"), below=[("s", "°", "Nm")]))
    (tmp_path / "columns.yaml").write_text("columns: {t_s: Zeit, q1_rad: Winkel, tau1_Nm: Moment}\n")
    r = read_recording(folder / "a.csv", A)
    np.testing.assert_allclose(r.q[:, 0], np.radians(Q), atol=1e-9)


def test_a_unit_that_nobody_knows_is_named(tmp_path):
    (tmp_path / "a.csv").write_text(table(below=[("s", "gon", "Nm")]))
    with pytest.raises(RecordingError, match=r"a\.csv: column 'q1_rad': unit 'gon'"):
        read_recording(tmp_path / "a.csv", A)


def test_a_clock_in_times_of_day_keeps_the_order_of_recordings(tmp_path):
    lines = table().splitlines()
    text = "\n".join([lines[0] + ",clock_s", *(f"{line},2024-05-03T12:00:{k % 60:02d}" for k, line in enumerate(lines[1:]))])
    (tmp_path / "a.csv").write_text(text + "\n")
    assert read_recording(tmp_path / "a.csv", A).clock[0] == pytest.approx(1714737600.0)


# time stamps in milliseconds at about 1 kHz
def coarse(share=0.004, rows=1000):
    t = np.arange(rows) / 1000
    for k in np.linspace(3, rows - 5, round(share * rows)).astype(int):
        t[k] = t[k - 1]
    return t


def test_stamps_that_repeat_now_and_then_are_spread_and_told(tmp_path):
    t = coarse()
    text = "t_s,q1_rad,tau1_Nm\n" + "".join(f"{x:.3f},{0.3 * np.sin(x):.9f},{0.5 * np.cos(x):.9f}\n" for x in t)
    (tmp_path / "a.csv").write_text(text)
    r = read_recording(tmp_path / "a.csv", A)
    assert (np.diff(r.t) > 0).all()
    assert np.abs(r.t - t).max() < 1.1e-3
    assert "4 time stamps that repeat (0.4%) spread until the next" in r.steps


def test_a_prediction_gives_the_stamps_back_as_they_were(tmp_path):
    from nnhydro.fitting.identify import identify

    model = identify(campaign(A, planted(A), 2, seconds=2.0, rate=50.0), "constant")
    t = coarse()
    (tmp_path / "a.csv").write_text("t_s,q1_rad\n" + "".join(f"{x:.3f},{0.3 * np.sin(x):.9f}\n" for x in t))
    np.testing.assert_array_equal(predict(model, read_recording(tmp_path / "a.csv", A, torque=False)).t, np.round(t, 3))


@pytest.mark.parametrize("t", [coarse(0.2), np.r_[0.0, 1, 1, 1, 1, np.arange(2, 400)], np.r_[0.0, 1, 1, 0.5, np.arange(2, 400)]],
                         ids=["one in five", "four in a row", "backward"])
def test_stamps_that_no_coarse_clock_explains_stay_as_they_are(t):
    spread, repeated = spread_stamps(t)
    assert repeated == 0
    np.testing.assert_array_equal(spread, t)


# folders
@pytest.fixture
def folder(tmp_path):
    return write_folder(campaign(A, planted(A), 3, seconds=2.0, rate=50.0), tmp_path / "c")


def test_all_broken_motions_are_listed_at_once(folder, tmp_path, capsys):
    assert run(["identify", str(folder), "--out", str(tmp_path / "m"), "--quiet"]) == 0
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text("nonsense\n")
    capsys.readouterr()
    assert run(["predict", str(tmp_path / "m"), str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), "--out", str(tmp_path / "t")]) == 2
    err = capsys.readouterr().err
    assert "a.csv" in err
    assert "b.csv" in err


@pytest.mark.parametrize("command", ["check", "identify", "benchmark"])
def test_every_command_that_reads_a_campaign_takes_a_mapping(command, folder, tmp_path):
    for path in (folder / "recordings").iterdir():
        path.write_text(path.read_text().replace("q1_rad", "angle"))
    (tmp_path / "map.yaml").write_text("columns: {q1_rad: angle}\n")
    more = {"check": [], "identify": ["--out", str(tmp_path / "m")],
            "benchmark": ["--models", "constant", "--folds", "2", "--out", str(tmp_path / "b")]}[command]
    assert run([command, str(folder), "--map", str(tmp_path / "map.yaml"), "--quiet", *more]) == 0


def test_every_command_with_a_campaign_has_the_option_map():
    import inspect

    from nnhydro.cli.main import build

    options = {command.name: inspect.signature(command.callback).parameters for command in build().registered_commands}
    readers = {name for name, names in options.items() if "campaign" in names}
    assert readers >= {"check", "identify", "train", "benchmark", "diagnose"}
    assert {name for name, names in options.items() if "column_map" in names} >= readers


def test_check_says_what_was_made_of_the_files(tmp_path, capsys):
    (tmp_path / "recordings").mkdir()
    (tmp_path / "recordings" / "a.csv").write_text(table(";", ","))
    (tmp_path / "arm.yml").write_text(yaml.safe_dump(A.document()))
    assert survey(open_campaign(tmp_path)).entries[0].steps == ("decimal commas",)
    assert run(["check", str(tmp_path)]) == 0
    assert "Read: decimal commas." in capsys.readouterr().out
