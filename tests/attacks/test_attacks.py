"""Attacks on a stranger's folder, kept: each is one line of ATTACKS or CALLS, tried on a healthy campaign made without nnhydro.

Whatever is done to a folder or asked of a command, it ends with exit 0 and says what it made of it, or with exit 2 and one line; what lay
there before lies there after, byte for byte.
"""

import gzip
import hashlib
import re
import shutil

import numpy as np
import pytest
import yaml
from strangers import ARM, runs

from nnhydro.cli.main import run

# ruff: noqa: E501 - one attack a line reads better than one that is wrapped
KEPT = 30  # attacks at least
NAMES = ("t_s", "q1_rad", "tau1_Nm")
TABLES = [np.column_stack(recording) for recording in runs(50.0, count=3)]  # t, q, tau


def text(table, names=NAMES, delimiter=",", decimal=".", below=()):
    rows = [delimiter.join(f"{x:.7f}".replace(".", decimal) for x in row) for row in table]
    return "\n".join([delimiter.join(names), *below, *rows]) + "\n"


def write(root, tables=TABLES, names=NAMES, arm=ARM, **how):
    (root / "recordings").mkdir(parents=True, exist_ok=True)
    (root / "arm.yaml").write_text(yaml.safe_dump(arm))
    for k, table in enumerate(tables):
        (root / "recordings" / f"run{k + 1}.csv").write_text(text(table, names, **how))
    return root


def first(root):
    return root / "recordings" / "run1.csv"


def changed(column, change):
    """All recordings with one column (by its number) made into another."""
    def attack(root):
        made = []
        for table in TABLES:
            table = table.copy()
            table[:, column] = change(table[:, column])
            made.append(table)
        write(root, made)
    return attack


def with_rate(change):
    """All recordings with a rate column: what `change` makes of the true one."""
    return lambda root: write(root, [np.column_stack([table, change(np.gradient(table[:, 1], table[:, 0]))]) for table in TABLES],
                              (*NAMES, "dq1_rad_s"))


def edited(change):
    return lambda root: first(root).write_text(change(first(root).read_text()))


def binary(change):
    return lambda root: first(root).write_bytes(change(first(root).read_bytes()))


def laid_out(**how):
    return lambda root: write(root, **how)


def beside(name, content=b"x"):
    def attack(root):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_bytes(content)
    return attack


def an_arm(**changes):
    return lambda root: write(root, arm={**ARM, **changes})


def a_link(**changes):
    return an_arm(links=[{**ARM["links"][0], **changes}])


def stuck(x):
    x = x.copy()
    x[100:200] = x[100]
    return x


def holes(x):
    x = x.copy()
    x[50:60] = np.nan
    return x


def wrapped(x):
    return np.mod(5 * x + np.pi, 2 * np.pi) - np.pi


def stamps(root):
    when = np.datetime64("2024-05-03T14:07:12")
    for k, table in enumerate(TABLES):
        rows = [f"{when + np.timedelta64(round(1e6 * t), 'us')},{q:.7f},{tau:.7f}" for t, q, tau in table]
        (root / "recordings" / f"run{k + 1}.csv").write_text("\n".join([",".join(NAMES), *rows]) + "\n")


MAPPED = b"columns: {q1_rad: {from: q1_rad, unit: %s}}"
TWO = [{"length_m": 0.5, "diameter_m": 0.06, "mass_kg": 1.0, "com_m": 0.2, "inertia_kg_m2": 0.02}, {"length_m": 0.4, "diameter_m": 0.05, "mass_kg": 0.8, "com_m": 0.2, "inertia_kg_m2": 0.01}]

an_arm_of_two = {**ARM, "links": TWO}


def in_one(column, change):
    """The first recording with one column made into another."""
    def attack(root):
        table = TABLES[0].copy()
        table[:, column] = change(table[:, column])
        write(root, [table, *TABLES[1:]])
    return attack


def mapped_for_all(root):
    in_one(1, np.degrees)(root)
    beside("columns.yaml", MAPPED % b"deg")(root)


def with_carriage(speed):
    return lambda root: write(root, [np.column_stack([table, speed(table[:, 0])]) for table in TABLES], (*NAMES, "u0_m_s"))


def reordered(order):
    return lambda root: write(root, [TABLES[0][order(len(TABLES[0]))], *TABLES[1:]])


def columns_yml(root):
    changed(1, np.degrees)(root)
    beside("columns.yml", MAPPED % b"deg")(root)


def cut_to_a_minus(root):
    """The first recording ends within a cell: of -3.1415 its minus is left, and a 0 that some loggers write for what is missing."""
    stop = int(np.flatnonzero(TABLES[0][:, 2] < 0.7 * TABLES[0][:, 2].min())[-1]) + 1
    whole = text(TABLES[0][:stop]).rstrip()
    first(root).write_text(whole[:whole.rindex(",") + 1] + "-0\n")


# what is done to the folder; exit code of check; words that it must say, on one line where it refuses
ATTACKS = {
    "angles in degrees": (changed(1, np.degrees), 2, "probably degrees"),
    "angles in encoder ticks": (changed(1, lambda q: np.round(q * 65536 / 6.283)), 2, "turns"),
    "angles that begin again after a turn": (changed(1, wrapped), 2, "jumps by a turn"),
    "time in milliseconds": (changed(0, lambda t: 1e3 * t), 2, "unit: ms"),
    "a clock that never moves": (changed(0, lambda t: 0 * t), 2, "time repeats"),
    "a clock that was set back": (changed(0, lambda t: np.where(t > 5, t - 3, t)), 2, "runs backward"),
    "seconds since 1970": (changed(0, lambda t: t + 1.7e9), 0, "Usable: nothing looks wrong"),
    "torques of the wrong sign": (changed(2, np.negative), 0, "the torque of joint 1 has the wrong sign"),
    "angles of the wrong sign": (changed(1, np.negative), 0, "has the wrong sign"),
    "torques in millinewton metres": (changed(2, lambda x: 1e3 * x), 0, "seem to be in mN m"),
    "torques in kilonewton metres": (changed(2, lambda x: 1e-3 * x), 0, "seem to be in kN m"),
    "a dead torque channel": (changed(2, np.zeros_like), 0, "dead or not updated"),
    "a torque that hangs for two seconds": (changed(2, stuck), 0, "dead or not updated"),
    "a sensor at the end of its range": (changed(2, lambda x: np.clip(x, 0.6 * x.min(), 0.6 * x.max())), 0, "stays at"),
    "cells without a number": (changed(2, holes), 0, "hold no finite number"),
    "infinities": (changed(2, lambda x: np.where(np.arange(len(x)) == 70, np.inf, x)), 0, "holds? no finite number"),
    "torques that are all empty": (changed(2, lambda x: np.nan * x), 2, "holds no finite number"),
    "rates of the wrong sign": (with_rate(np.negative), 0, "dq1_rad_s: has the wrong sign"),
    "rates in degrees": (with_rate(np.degrees), 0, "is in deg/s"),
    "one file twice": (lambda root: shutil.copy(first(root), root / "recordings" / "run9.csv"), 0, "copies of one run"),
    "decimal commas": (laid_out(delimiter=";", decimal=","), 0, "Read: decimal commas"),
    "UTF-16": (binary(lambda x: x.decode().encode("utf-16")), 0, "Read: text in utf-16"),
    "a row of units": (laid_out(below=["s,rad,Nm"]), 0, "Read: units from the row"),
    "dates and times of day": (stamps, 0, "Read: t_s: dates and times of day"),
    "what a logger writes above the header": (edited(lambda x: "Logger 3.2\nserial no.;A-17\n\n" + x), 0, "Read: 2 lines above the header"),
    "a minus of typographers": (edited(lambda x: x.replace("-", "\N{MINUS SIGN}")), 0, "Usable: nothing looks wrong"),
    "line ends of an old Mac": (binary(lambda x: x.replace(b"\n", b"\r")), 0, "Usable: nothing looks wrong"),
    "the header again in the middle": (edited(lambda x: x + x), 2, "is not a number"),
    "a row that was cut off": (binary(lambda x: x[:-12]), 0, "hold no finite number"),
    "zeros where the disk was full": (binary(lambda x: x[:9000] + b"\0" * 400), 2, "is not a number|is not UTF-8"),
    "thousands separators": (edited(lambda x: x.replace("\n1.0000000,", '\n"1,000.0",', 1)), 2, "fields|is not a number|decimal"),
    "an empty file": (edited(lambda x: ""), 2, "is empty"),
    "a header without rows": (edited(lambda x: x.partition("\n")[0] + "\n"), 2, "no rows"),
    "a compressed file under another name": (binary(gzip.compress), 2, "not UTF-8"),
    "a workbook under another name": (binary(lambda x: b"PK\3\4\0\0" * 90), 2, "no header line"),
    "a workbook": (beside("recordings/run9.xlsx"), 2, "is none of"),
    "a folder among the runs": (beside("recordings/day2/run.csv"), 2, "is a folder"),
    "files of the system": (beside("recordings/Thumbs.db"), 0, "Usable: nothing looks wrong"),
    "arm.yml": (lambda root: (root / "arm.yaml").rename(root / "arm.yml"), 0, "Usable: nothing looks wrong"),
    "arm.yaml and arm.yml": (beside("arm.yml", b"{}"), 2, "both arm.yaml and arm.yml"),
    "no arm at all": (lambda root: (root / "arm.yaml").unlink(), 2, "has no arm.yaml"),
    "a link in millimetres": (a_link(length_m=800.0, diameter_m=80.0), 2, "length_m|longer|mm"),
    "a diameter of nothing": (a_link(diameter_m=0.0), 2, "diameter_m"),
    "a negative mass": (a_link(mass_kg=-3.0), 2, "mass_kg"),
    "a key that nobody knows": (a_link(lenght_m=0.8), 2, "unknown key"),
    "a prismatic joint in a chain": (an_arm(links=TWO, joints=[{"type": "prismatic"}, {"type": "revolute"}]), 2, "a prismatic joint must be the only one"),
    "an arm that is a list": (beside("arm.yaml", b"- 1\n"), 2, "holds a list"),
    "a unit that nobody knows": (beside("columns.yaml", MAPPED % b"gon"), 2, "unit 'gon'"),
    "a mapping of a column that is not there": (beside("columns.yaml", b"columns: {q1_rad: shoulder}"), 2, "is not there"),
    "a second joint that the arm has not": (lambda root: write(root, names=("t_s", "q1_rad", "tau2_Nm")), 2, "tau1_Nm|joint 2"),
    "a carriage in millimetres a second": (with_carriage(lambda t: 600 * np.tanh(t)), 2, "faster than any towing tank; in mm/s that would be 0.6 m/s: .*unit: mm/s"),
    "a carriage of 50 m/s": (with_carriage(lambda t: 50 * np.tanh(t)), 0, "faster than any towing tank"),
    "one file in degrees": (in_one(1, np.degrees), 2, "probably degrees: only 1 of 3 recordings is so: convert q1_rad from degrees to rad in the file; a line in columns.yaml would"),
    "one file in milliseconds": (in_one(0, lambda t: 1e3 * t), 2, "only 1 of 3 recordings is so: convert t_s from ms to s in the file"),
    "one file in degrees, mapped for all": (mapped_for_all, 0, "q1_rad, run2, run3: is 57.3 times too small there, converted from deg"),
    "one file in millinewton metres": (in_one(2, lambda x: 1e3 * x), 0, "tau1_Nm, run1: is 1e.03 times too large there, as in mN m"),
    "a time that runs ten times too fast": (changed(0, lambda t: 0.02 * t), 0, "the time is probably too short"),
    "a reading of -9999 in an angle": (in_one(1, lambda q: np.where(np.arange(len(q)) == 70, -9999.0, q)), 0, "q1_rad, row 72: reads -9999, far outside all other values"),
    "a reading of 1e5 in an angle": (in_one(1, lambda q: np.where(np.arange(len(q)) == 70, 1e5, q)), 0, "q1_rad, row 72: reads 100000"),
    "a reading of -999 in a torque": (in_one(2, lambda x: np.where(np.arange(len(x)) == 70, -999.0, x)), 0, "tau1_Nm, row 72: reads -999"),
    "torques of noise": (changed(2, lambda x: np.random.default_rng(1).standard_normal(len(x))), 0, "is noise from row to row"),
    "torques of another course": (changed(2, lambda x: 9 + np.cos(np.arange(len(x)) / 7.3)), 0, "explains next to nothing of the torques"),
    "encoders that are off": (changed(1, lambda q: 0 * q + 0.3), 0, "no angle changes in any recording"),
    "a last cell that was cut to its minus": (cut_to_a_minus, 0, "ends with -0, which lost its digits"),
    "rows at random": (reordered(lambda n: np.random.default_rng(1).permutation(n)), 2, "not in the order of time: sort them by t_s"),
    "rows in reverse": (reordered(lambda n: np.arange(n)[::-1]), 2, "in reverse order: sort its rows by t_s"),
    "a density in g/cm3": (an_arm(fluid={"density_kg_m3": 1.0, "kinematic_viscosity_m2_s": 1e-6}), 0, "no gas has a kinematic viscosity of 1e-06"),
    "a density of nothing known": (an_arm(fluid={"density_kg_m3": 62.4}), 0, "no gas or liquid has 62.4 kg/m3"),
    "the dynamic viscosity": (an_arm(fluid={"density_kg_m3": 1000.0, "kinematic_viscosity_m2_s": 1e-3}), 0, "0.001 m2/s is 1e.03 times that of water"),
    "a mass in grams": (a_link(mass_kg=3000.0), 0, "3000 kg in 4.02 litres"),
    "a mass that is true": (a_link(mass_kg=True), 2, r"mass_kg: is true, not a number"),
    "columns.yml": (columns_yml, 0, "Usable: nothing looks wrong"),
    "columns.yaml and columns.yml": (lambda root: (beside("columns.yaml", b"{}")(root), beside("columns.yml", b"{}")(root)), 2, "both columns.yaml and columns.yml"),
    "a folder called almost as it should be": (lambda root: shutil.copytree(root / "recordings", root / "recording"), 0, "recording/: holds 3 log.s., but only recordings/ is read"),
    "a log beside arm.yaml": (beside("run9.csv", b"t_s\n"), 0, "run9.csv: lies beside arm.yaml: nnhydro does not read it"),
    "an unseen motion that cannot be read": (beside("unseen/x.csv", b"t_s,q1_rad\n0,zero\n"), 0, "unseen/x.csv: column 'q1_rad', row 2: 'zero' is not a number"),
    "one column for two joints": (lambda root: (write(root, arm=an_arm_of_two, names=("t_s", "q1_rad", "M")), beside("columns.yaml", b"columns: {q2_rad: {from: q1_rad, sign: -1}, tau1_Nm: M, tau2_Nm: M}")(root)), 2, "'tau1_Nm' and 'tau2_Nm' are both taken from the column 'M'"),
    "control sequences in a name": (lambda root: first(root).write_text("t_s,\x1b[31mq1,tau1_Nm\n0,0,0\n"), 2, "q1_rad"),
}


def tree(root):
    """Every file below a folder with its content, but for nnhydro's locks."""
    return {path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(root.rglob("*")) if path.is_file()}


def answered(capsys, code, *arguments):
    """What a command says, on standard output and in its one line of error."""
    capsys.readouterr()
    assert run([str(a) for a in arguments]) == code
    out, err = capsys.readouterr()
    if code == 2:
        lines = [line for line in err.splitlines() if not line.startswith("warning")]
        assert len(lines) == 1, err
        assert lines[0].startswith("nnhydro: error: ")
        assert len(lines[0]) > 30
    assert "Traceback" not in out + err
    assert "\x1b" not in out + err
    return out + err


def test_there_are_as_many_as_were_promised():
    assert len(ATTACKS) + len(CALLS) >= 2 * KEPT


@pytest.mark.parametrize("name", ATTACKS)
def test_an_attack_on_a_folder_is_told_and_loses_nothing(name, tmp_path, capsys):
    attack, code, words = ATTACKS[name]
    root = write(tmp_path / "a stranger's folder")
    attack(root)
    before = tree(root)
    said = answered(capsys, code, "check", root)
    assert re.search(words, said), said
    assert tree(root) == before


# what is asked of a command; exit code; words; {c} is the campaign, {m} a model of it, {o} a place for results
CALLS = {
    "predictions into the folder of their motions": ("predict {m} {c}/recordings/run1.csv --out {c}/recordings", 2, "is one of the inputs"),
    "predictions among the recordings": ("predict {m} {o}/new.csv --out {c}/recordings", 2, "every file is read as a recording"),
    "a model among the recordings": ("identify {c} --out {c}/recordings/model", 2, "every file is read as a recording"),
    "a model in the place of the campaign": ("identify {c} --out {c}", 2, "holds other files"),
    "a model in the place of a recording": ("identify {c} --out {c}/recordings/run1.csv", 2, "is a file"),
    "a diagnosis in the place of the recordings": ("diagnose {c} --out {c}/recordings", 2, "every file is read as a recording|holds other files"),
    "a benchmark in the place of the model": ("benchmark {c} --models constant --out {m}", 2, "holds other files"),
    "an export over the arm": ("export {m} --format mujoco --out {c}/arm.yaml", 2, "did not write it"),
    "a log of a training among the recordings": ("train {c} --out {o}/net --tensorboard {c}/recordings", 2, "every file is read as a recording"),
    "a mapping that is not there": ("check {c} --map {o}/nowhere.yaml", 2, "cannot be read"),
    "a campaign that is not there": ("check {o}/nowhere", 2, "does not exist"),
    "a campaign that is a file": ("check {c}/arm.yaml", 2, "is a file"),
    "a model that is a campaign": ("predict {c} {c}/recordings/run1.csv --out {o}/t", 2, "model"),
    "a model that nobody knows": ("identify {c} --model banana --out {o}/m", 2, "banana"),
    "a benchmark on what its model has seen": ("benchmark {c} --models {m} --out {o}/b", 2, "has seen 3 of the 3 recordings"),
    "motions in degrees": ("predict {m} {o}/degrees.csv --out {o}/t", 0, "100% of the rows lie outside"),
    "motions in degrees, strictly": ("predict {m} {o}/degrees.csv --out {o}/t --strict", 2, "probably degrees"),
    "two motions of one name": ("predict {m} {o}/new.csv {c}/../x/new.csv --out {o}/t", 2, "two motions are called"),
    "a cut-off beyond half the sampling rate": ("check {c} --cutoff 1000", 2, "cut-off 1000 Hz: lies above half the sampling rate, 25 Hz"),
    "a fit above half the sampling rate": ("identify {c} --cutoff 30 --out {o}/m", 2, "lies above half the sampling rate"),
    "a diagnosis above half the sampling rate": ("diagnose {c} --cutoff 30 --out {o}/d", 2, "lies above half the sampling rate"),
    "a cut-off of hours": ("check {c} --cutoff 0.0001", 2, "holds less than one period of it"),
    "a negative cut-off": ("check {c} --cutoff -3", 2, "positive frequency"),
    "a campaign on paper in the place of a measured one": ("simulate {o}/recipe.yaml --out {c}", 2, "holds other files"),
}


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    root = tmp_path_factory.mktemp("fitted")
    write(root / "c")
    assert run(["identify", str(root / "c"), "--out", str(root / "m"), "--quiet"]) == 0
    return root


@pytest.fixture
def place(fitted, tmp_path):
    for name in ("c", "m"):
        shutil.copytree(fitted / name, tmp_path / name)
    (tmp_path / "o").mkdir()
    (tmp_path / "o" / "recipe.yaml").write_text(yaml.safe_dump({"arm": ARM, "terms": {"normal_drag": {"C_D": 1.0}}, "motions": [
        {"kind": "slew", "name": "reach", "q_rad": [[0.0], [1.0]], "duration_s": 1.0}]}))
    (tmp_path / "x").mkdir()
    for name, scale in (("o/new.csv", 1.0), ("x/new.csv", 1.0), ("o/degrees.csv", 57.29578)):
        (tmp_path / name).write_text(text(TABLES[0][:, :2] * (1.0, scale), NAMES[:2]))
    return tmp_path


@pytest.mark.parametrize("name", CALLS)
def test_a_call_that_would_harm_is_refused_or_told_and_loses_nothing(name, place, capsys):
    line, code, words = CALLS[name]
    before = tree(place)
    said = answered(capsys, code, *(word.format(c=place / "c", m=place / "m", o=place / "o") for word in line.split()))
    assert re.search(words, said), said
    after = tree(place)
    assert {path: after.get(path) for path in before} == before
    if code == 2:
        assert after == before


# what is said next can be typed

def test_the_next_command_can_be_typed_where_names_hold_blanks(tmp_path, capsys):
    import shlex

    root = write(tmp_path / "my rig's folder")
    following = answered(capsys, 0, "check", root).rpartition("Next: ")[2].strip()
    assert shlex.split(following)[:3] == ["nnhydro", "benchmark", str(root)]


def test_the_next_command_keeps_the_mapping(tmp_path, capsys):
    root = write(tmp_path / "c", names=("Zeit", "q1_rad", "tau1_Nm"))
    (tmp_path / "my map.yaml").write_text("columns: {t_s: Zeit}\n")
    said = answered(capsys, 0, "check", root, "--map", tmp_path / "my map.yaml")
    assert f"--map '{tmp_path / 'my map.yaml'}'" in said.rpartition("Next: ")[2]


@pytest.mark.slow
def test_what_makes_a_campaign_unusable_is_told_by_every_command_that_works_on_it(tmp_path, capsys):
    root = tmp_path / "c"
    write(root)
    changed(1, np.degrees)(root)
    for command in (["identify", root, "--out", tmp_path / "m"], ["benchmark", root, "--models", "constant", "--folds", "2", "--out", tmp_path / "b"]):
        said = answered(capsys, 0, *command)
        assert "nnhydro check calls this campaign not usable" in said
        assert f"Next: nnhydro check {root}" in said


@pytest.mark.parametrize(("row", "columns"), [("a", "columns: {q1_rad: {from: q1_rad, period: 6.2831853}}"),
                                              ("b", "columns: {q1_rad: {from: a, unit: deg, period: 360, sign: -1, offset: 90}}")])
def test_an_angle_that_begins_again_goes_on_where_its_period_is_stated(row, columns, tmp_path, capsys):
    from nnhydro.recordings.campaign import open_campaign

    true = 5 * TABLES[0][:, 1]
    seen = wrapped(TABLES[0][:, 1]) if row == "a" else np.mod(90 - np.degrees(true), 360)
    root = write(tmp_path / "c", [np.column_stack([TABLES[0][:, 0], seen, TABLES[0][:, 2]])], NAMES if row == "a" else ("t_s", "a", "tau1_Nm"))
    (root / "columns.yaml").write_text(columns)
    got = open_campaign(root).load("run1").q[:, 0]
    np.testing.assert_allclose(np.diff(got), np.diff(true) if row == "a" else np.diff(np.radians(np.degrees(true))), atol=1e-6)


def test_a_gap_in_an_angle_does_not_break_its_period(tmp_path):
    from nnhydro.recordings.readers.column_map import unwrap

    x = np.array([350.0, 355.0, np.nan, 5.0, 10.0])
    np.testing.assert_allclose(unwrap(x, 360.0), [350.0, 355.0, np.nan, 365.0, 370.0])


def test_rates_that_are_wrong_do_not_make_the_order_of_channels_look_wrong(tmp_path, capsys):
    with_rate(np.negative)(write(tmp_path / "c"))
    assert "exchanged" not in answered(capsys, 0, "check", tmp_path / "c")


