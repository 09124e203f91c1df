"""The list of what nnhydro wrote loses no file, however many processes write into one folder."""

import json
from concurrent.futures import ThreadPoolExecutor

from nnhydro.runtime.files import write_output
from nnhydro.runtime.stamp import STAMP, is_ours


def test_files_written_at_the_same_time_are_all_listed(tmp_path):
    paths = [tmp_path / f"{k}.txt" for k in range(40)]
    with ThreadPoolExecutor(8) as many:  # each holds a handle of its own, as processes do
        list(many.map(lambda path: write_output(path, path.name), paths))
    assert sorted(json.loads((tmp_path / STAMP).read_text())["files"]) == sorted(path.name for path in paths)
    assert all(map(is_ours, paths))
    assert {path.name for path in tmp_path.iterdir()} == {STAMP, *(path.name for path in paths)}, "no lock is left"
