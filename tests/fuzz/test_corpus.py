"""Every input that a reader once stumbled over is read again: a result or one line, in time."""

import sys
import time
import warnings
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from targets import targets  # noqa: E402

TARGETS = {name.replace(" ", "_"): target for name, target in targets().items()}
CORPUS = sorted(path for path in (HERE / "corpus").glob("*/*") if path.is_file())


@pytest.mark.parametrize("path", CORPUS, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_what_once_failed_gets_a_result_or_one_line(path, tmp_path):
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numbers at the edge of what a float holds overflow on the way
        TARGETS[path.parent.name](path.read_bytes(), tmp_path)
    assert time.process_time() - start < 5


@pytest.mark.parametrize("name", TARGETS)
def test_the_file_that_fuzzing_begins_with_is_accepted(name, tmp_path):
    target = TARGETS[name]
    accepted = [target(data, tmp_path) for data in target.seeds]
    assert accepted[0]
    assert all(accepted) or name == "recipe", "its last one names a file that is not there"


@pytest.mark.parametrize("name", TARGETS)
def test_an_empty_file_and_one_of_zeros_get_one_line(name, tmp_path):
    empty, zeros = (TARGETS[name](data, tmp_path) for data in (b"", b"\0" * 1000))
    assert empty == (name == "config"), "a configuration that says nothing is the default one"
    assert not zeros
