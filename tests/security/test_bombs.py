"""A few kilobytes that would fill the memory, or work without end: refused in one line before they do."""

import sqlite3
import time

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from planted import the_arm

from nnhydro.errors import ArmError, RecordingError
from nnhydro.recordings.filtering.preprocessing import plan
from nnhydro.recordings.readers.files import read_recording, read_steady
from nnhydro.recordings.readers.yaml_file import read_yaml
from nnhydro.recordings.recording import Recording

ARM = the_arm(links=(the_arm().links[0],))
COLUMNS = ("t_s", "q1_rad", "tau1_Nm")


def zeros_in_parquet(path):
    column = pa.DictionaryArray.from_arrays(pa.array(np.zeros(6_500_000, np.int8)), pa.array([0.0]))
    pq.write_table(pa.table(dict.fromkeys(COLUMNS, column)), path, compression="zstd")


def sparse_hdf5(path):
    with h5py.File(path, "w") as file:
        for name in COLUMNS:
            file.create_dataset(name, shape=(40_000_000,), dtype="f8", chunks=(1000,))


def huge_chunk_in_hdf5(path):
    with h5py.File(path, "w") as file:
        for name in COLUMNS:
            file.create_dataset(name, shape=(100,), maxshape=(None,), dtype="f8", chunks=(60_000_000,), compression="gzip")


def short_rows_in_csv(path):
    path.write_text(",".join([*COLUMNS, *(f"c{i}" for i in range(1900))]) + "\n" + "1\n" * 200_000)


def long_header_in_csv(path):
    path.write_text(",".join(f"c{i}" for i in range(50_000)) + "\n1\n")


@pytest.mark.parametrize(("name", "make", "said"), [
    ("x.parquet", zeros_in_parquet, "made to fill the memory"), ("x.h5", sparse_hdf5, "made to fill the memory"),
    ("x.h5", huge_chunk_in_hdf5, "made to fill the memory"), ("x.csv", short_rows_in_csv, "made to fill the memory"),
    ("x.csv", long_header_in_csv, "too many"),
], ids=lambda x: getattr(x, "__name__", ""))
def test_a_file_that_would_unpack_to_far_more_than_it_can_have_measured_is_refused(name, make, said, tmp_path):
    make(tmp_path / name)
    start = time.perf_counter()
    with pytest.raises(RecordingError, match=said):
        read_recording(tmp_path / name, ARM)
    assert time.perf_counter() - start < 5


def test_one_long_name_in_very_many_rows_is_refused(tmp_path):
    rows, text = 5000, "x" * 100_000
    names = pa.DictionaryArray.from_arrays(pa.array(np.zeros(rows, int)), pa.array([text]))
    pq.write_table(pa.table({"run": names, "q1_rad": np.zeros(rows), "tau1_Nm": np.zeros(rows)}), tmp_path / "x.parquet")
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["q1_rad"], file["tau1_Nm"] = np.zeros(rows), np.zeros(rows)
        file.create_dataset("run", shape=(rows,), dtype=h5py.string_dtype(), fillvalue=text)
    for name in ("x.parquet", "x.h5"):
        with pytest.raises(RecordingError, match="is it a column of short names"):
            read_steady(tmp_path / name, ARM)


def test_a_view_in_a_bag_is_not_followed(tmp_path):
    with sqlite3.connect(tmp_path / "x.db3") as database:
        database.execute("CREATE VIEW messages AS WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n) SELECT k FROM n")
    database.close()
    with pytest.raises(RecordingError, match="holds the view 'messages'"):
        read_recording(tmp_path / "x.db3", ARM)


def test_a_clock_that_jumps_does_not_become_billions_of_rows():
    t = np.concatenate([np.cumsum([1e-12] * 7 + [9.0] * 5), 1000 + np.arange(100)])
    made = Recording("run", t, np.zeros((len(t), 1)), np.zeros((len(t), 1)))
    with pytest.raises(RecordingError, match=r"run: its 12 rows .* the clock jumps"):
        plan(iter([made]))


@pytest.mark.parametrize(("text", "said"), [
    ("a: &x [1]\nb: *x", "aliases"), ("a: " + "[" * 5000, "nested"), ("a: " + "{a: " * 5000, "nested"),
    ("a: 1" + ":59" * 20_000, "characters"), ("a: 12:30", "base of sixty"), ("a: 9" + "_9" * 4900, "not valid YAML"),
    ("a: !!python/object/apply:os.system ['true']", "not valid YAML"),
    ("a: 1\n" * 100_000, "too many"), ("- " * 9000, "nested"), ("a: 1\na: 2", "appears twice"),
], ids=range(10))
def test_hostile_YAML_gets_one_line_at_once(text, said, tmp_path):
    (tmp_path / "arm.yaml").write_text(text)
    start = time.perf_counter()
    with pytest.raises(ArmError, match=said):
        read_yaml(tmp_path / "arm.yaml", ArmError)
    assert time.perf_counter() - start < 2
