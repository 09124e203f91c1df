"""Every format gives the same recording; whatever stands in a file, the answer is a recording or one clear line."""

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planted import healthy, line_of, recording, the_arm, write_csv

from nnhydro.errors import ConfigError, MissingExtraError, RecordingError
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.readers.column_map import parse_column_map
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.readers.ros_bag import order_by_number
from nnhydro.recordings.readers.yaml_file import read_yaml
from nnhydro.recordings.recording import Recording

ARM = the_arm()
ONE = Arm.model_validate({"fluid": {}, "links": [{"length_m": 1, "diameter_m": 0.1, "mass_kg": 1, "com_m": 0.5, "inertia_kg_m2": 0.1}]}
                         | {"fluid": {"density_kg_m3": 1000}})
WANT = healthy(rows=50)
FEW = settings(max_examples=60, derandomize=True, deadline=None)


def same(r: Recording, exact: bool = True) -> None:
    want = recording(WANT)
    for name in ("t", "q", "qd", "tau"):
        got, expected = getattr(r, name), getattr(want, name)
        np.testing.assert_allclose(got, expected, rtol=0, atol=0 if exact else 1e-9, err_msg=name)


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_csv_is_read_to_the_last_digit(tmp_path: Path, delimiter: str):
    write_csv(tmp_path / "a.csv", WANT, delimiter)
    same(read_recording(tmp_path / "a.csv", ARM))


@pytest.mark.parametrize("change", [
    lambda b: b"\xef\xbb\xbf" + b, lambda b: b + b"\r\n\r\n\n", lambda b: b"# log of rig 3\n\n" + b, lambda b: b"sep=,\n" + b,
    lambda b: b.replace(b"\r\n", b"\n"), lambda b: b.replace(b"\r\n", b",\r\n"), lambda b: b.replace(b"t_s", b" t_s ", 1),
], ids=["byte-order mark", "trailing empty lines", "comment", "Excel's sep line", "unix lines", "trailing comma", "padded names"])
def test_csv_habits_of_loggers_are_understood(tmp_path: Path, change):
    write_csv(tmp_path / "a.csv", WANT)
    (tmp_path / "a.csv").write_bytes(change((tmp_path / "a.csv").read_bytes()))
    same(read_recording(tmp_path / "a.csv", ARM))


def test_a_parquet_file_that_declares_a_column_which_it_does_not_hold_is_called_damaged(tmp_path: Path):
    damaged = tmp_path / "run.parquet"
    damaged.write_bytes((Path(__file__).parents[3] / "fuzz" / "corpus" / "parquet" / "8d2714954d7c").read_bytes())
    with pytest.raises(RecordingError, match=r"declares the column u0_m_s but does not hold it"):
        read_recording(damaged, the_arm())


def test_parquet_hdf5_and_csv_agree(tmp_path: Path):
    import h5py
    import pandas as pd

    pd.DataFrame(WANT).to_parquet(tmp_path / "a.parquet")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, values in WANT.items():
            file[name] = values
    with h5py.File(tmp_path / "group.hdf5", "w") as file:
        for name, values in WANT.items():
            file[f"run/{name}"] = values
    with h5py.File(tmp_path / "table.hdf5", "w") as file:
        file["table"] = np.array(list(zip(*WANT.values(), strict=True)), dtype=[(name, "f8") for name in WANT])
    for name in ("a.parquet", "a.h5", "group.hdf5", "table.hdf5"):
        same(read_recording(tmp_path / name, ARM))


def test_columns_of_an_hdf5_array_are_named_by_number(tmp_path: Path):
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t_s"] = WANT["t_s"]
        file["q"] = np.column_stack([WANT["q1_rad"], WANT["q2_rad"]])
        file["tau"] = np.column_stack([WANT["tau1_Nm"], WANT["tau2_Nm"]])
    columns = {"q1_rad": "q[1]", "q2_rad": "q[2]", "tau1_Nm": "tau[1]", "tau2_Nm": "tau[2]"}
    r = read_recording(tmp_path / "a.h5", ARM, column_map=parse_column_map({"columns": columns}, "map"))
    np.testing.assert_array_equal(r.q[:, 1], WANT["q2_rad"])


def test_hdf5_that_leads_into_other_files_is_refused(tmp_path: Path):
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t_s"] = h5py.ExternalLink("/etc/passwd", "/x")
    with pytest.raises(RecordingError, match="link into another file: copy the data"):
        read_recording(tmp_path / "a.h5", ARM)


def joint_state_bag(path: Path, kind: str, names: tuple[str, str] = ("joint2", "joint1"), topics: int = 1, stamped: bool = True) -> None:
    """Write the healthy run as JointState messages, outer joint first, as ROS sorts no joints by position."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
    types = store.types
    plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
    with (Writer1(path) if kind == "bag" else Writer2(path, version=9, storage_plugin=plugin)) as writer:
        for topic in range(topics):
            c = writer.add_connection(f"/joints{topic}", "sensor_msgs/msg/JointState", typestore=store)
            for row, t in enumerate(WANT["t_s"]):
                ns = 1_700_000_000_000_000_000 + round(t * 1e9)
                stamp = types["builtin_interfaces/msg/Time"](sec=ns // 10**9 if stamped else 0, nanosec=ns % 10**9 if stamped else 0)
                extra = {"seq": row} if kind == "bag" else {}
                header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="", **extra)
                pair = {key: np.array([WANT[f"{key}2_{unit}"][row], WANT[f"{key}1_{unit}"][row]])
                        for key, unit in (("q", "rad"), ("dq", "rad_s"), ("tau", "Nm"))}
                m = types["sensor_msgs/msg/JointState"](header=header, name=list(names), position=pair["q"], velocity=pair["dq"],
                                                        effort=pair["tau"])
                raw = store.serialize_ros1(m, c.msgtype) if kind == "bag" else store.serialize_cdr(m, c.msgtype)
                writer.write(c, ns + 3_000_000, raw)


@pytest.mark.parametrize("kind", ["bag", "mcap", "db3"])
def test_ros_joint_states_are_read_by_joint_name_and_header_stamp(tmp_path: Path, kind: str):
    path = tmp_path / ("run.bag" if kind == "bag" else "run")
    joint_state_bag(path, kind)
    r = read_recording(path, ARM)
    same(r, exact=False)
    assert "header stamps" in " ".join(r.steps)
    if kind != "bag":
        alone = next(path.glob(f"*.{kind}"))
        same(read_recording(alone, ARM), exact=False)
        assert read_recording(path, ARM, torque=False).tau is None


def test_foreign_joint_names_need_a_mapping_which_the_line_asks_for(tmp_path: Path):
    joint_state_bag(tmp_path / "run", "mcap", ("elbow", "shoulder"))
    with pytest.raises(RecordingError, match=r"joints are elbow, shoulder.*'joints: \[\.\.\.\]'"):
        read_recording(tmp_path / "run", ARM)
    same(read_recording(tmp_path / "run", ARM, column_map=parse_column_map({"joints": ["shoulder", "elbow"]}, "map")), exact=False)
    with pytest.raises(RecordingError, match="no joint 'wrist', but elbow, shoulder"):
        read_recording(tmp_path / "run", ARM, column_map=parse_column_map({"joints": ["shoulder", "wrist"]}, "map"))


def test_of_several_topics_one_is_to_be_chosen(tmp_path: Path):
    joint_state_bag(tmp_path / "run", "db3", topics=2)
    with pytest.raises(RecordingError, match="choose one by 'topic"):
        read_recording(tmp_path / "run", ARM)
    same(read_recording(tmp_path / "run", ARM, column_map=parse_column_map({"topic": "/joints1"}, "map")), exact=False)


def test_unstamped_joint_states_fall_back_on_the_time_of_logging_and_say_so(tmp_path: Path):
    joint_state_bag(tmp_path / "run", "mcap", stamped=False)
    r = read_recording(tmp_path / "run", ARM)
    same(r, exact=False)
    assert any("time of logging" in step for step in r.steps)


def test_joints_are_numbered_only_where_the_names_say_so():
    assert order_by_number(["joint_2", "joint_1"], 2) == ("joint_1", "joint_2")
    assert order_by_number(["joint0", "joint1"], 2) == ()
    assert order_by_number(["a1", "b1"], 2) == ()
    assert order_by_number(["joint1", "joint2", "gripper"], 2) == ()


@pytest.mark.parametrize(("library", "suffix", "extra"), [("h5py", "h5", "hdf5"), ("rosbags", "mcap", "ros")])
def test_a_missing_library_is_named_with_the_command_that_installs_it(tmp_path: Path, monkeypatch, library: str, suffix: str, extra: str):
    monkeypatch.setitem(sys.modules, library, None)
    (tmp_path / f"a.{suffix}").write_bytes(b"x")
    with pytest.raises(MissingExtraError, match=rf"pip install 'nnhydro\[{extra}\]'"):
        read_recording(tmp_path / f"a.{suffix}", ARM)


def test_without_torque_a_broken_torque_column_does_not_matter(tmp_path: Path):
    path = tmp_path / "a.csv"
    path.write_text("t_s,q1_rad,tau1_Nm,tau1_Nm,tau7_Nm\n" + "".join(f"{i / 10},{i},broken,,x\n" for i in range(9)))
    assert read_recording(path, ONE, torque=False).tau is None
    with pytest.raises(RecordingError, match="appears 2 times"):
        read_recording(path, ONE)


def test_foreign_columns_may_hold_anything(tmp_path: Path):
    path = tmp_path / "a.csv"
    path.write_text("t_s,q1_rad,tau1_Nm,note,note\n" + "".join(f"{i / 10},{i},1,fine day,1e99\n" for i in range(9)))
    assert len(read_recording(path, ONE)) == 9


@FEW
@given(st.binary(max_size=400))
@pytest.mark.parametrize("suffix", ["csv", "parquet", "h5", "bag", "mcap", "db3"])
def test_any_bytes_give_a_recording_or_one_line(tmp_path_factory, suffix: str, content: bytes):
    path = tmp_path_factory.mktemp("any") / f"a.{suffix}"
    path.write_bytes(content)
    one_line_or_result(path)


def one_line_or_result(path: Path) -> None:
    line = line_of(lambda: read_recording(path, ONE))
    assert line is None or (path.name in line and len(line) < 1000)


ODD = st.sampled_from(["", "NaN", "True", "1,5", '"', "#", "\0", ";"])
CELL = st.one_of(st.floats().map(repr), st.integers().map(str), st.text(max_size=8), ODD)


@FEW
@given(st.lists(st.lists(CELL, min_size=1, max_size=4), max_size=8), st.sampled_from(",;\t"))
def test_any_cells_below_a_good_header_give_a_recording_or_one_line(tmp_path_factory, rows: list[list[str]], delimiter: str):
    path = tmp_path_factory.mktemp("cells") / "a.csv"
    lines = [["t_s", "q1_rad", "tau1_Nm"], *rows]
    path.write_bytes("\n".join(delimiter.join(line) for line in lines).encode("utf-8", "replace"))
    one_line_or_result(path)


@FEW
@given(st.data())
def test_a_damaged_byte_in_a_good_file_gives_a_recording_or_one_line(tmp_path_factory, data):
    import h5py
    import pandas as pd

    folder = tmp_path_factory.mktemp("damaged")
    columns = {name: WANT[name] for name in ("t_s", "q1_rad", "tau1_Nm")}
    pd.DataFrame(columns).to_parquet(folder / "a.parquet")
    with h5py.File(folder / "a.h5", "w") as file:
        for name, values in columns.items():
            file[name] = values
    for path in (folder / "a.parquet", folder / "a.h5"):
        content = bytearray(path.read_bytes())
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
        path.write_bytes(bytes(content[: data.draw(st.integers(1, len(content)))]) if data.draw(st.booleans()) else bytes(content))
        one_line_or_result(path)


@FEW
@given(st.one_of(st.binary(max_size=200), st.text(max_size=200).map(lambda s: s.encode("utf-8", "replace")),
                 st.text(alphabet="a: -[]{}&*?|>!%'\"\n<0123.e_x", max_size=60).map(str.encode)))
def test_any_yaml_gives_a_mapping_or_one_line(tmp_path_factory, content: bytes):
    path = tmp_path_factory.mktemp("yaml") / "arm.yaml"
    path.write_bytes(content)
    line = line_of(lambda: read_yaml(path, ConfigError))
    assert line is None or "arm.yaml" in line
