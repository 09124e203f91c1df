"""An exception in a file of the user is told with file, line and function; any other passes as it is."""

import pytest

from nnhydro.errors import ConfigError, ModelError
from nnhydro.runtime import user_code
from nnhydro.runtime.user_code import fault, named_faults, place_of, register_user_file

CODE = """def load(x):
    return inverse(x)
def inverse(x):
    if x > 1:
        raise error(x)
    return 1 / x
"""


@pytest.fixture
def load(tmp_path, monkeypatch):
    """A function of a user's file."""
    monkeypatch.setattr(user_code, "_FILES", {})
    path = tmp_path / "mine.py"
    path.write_text(CODE)
    names = {"error": lambda x: ModelError("too large") if x < 9 else MemoryError()}
    exec(compile(CODE, str(path), "exec"), names)
    register_user_file(path)
    return names["load"], path


def test_a_fault_of_the_user_is_one_line_with_its_place(load):
    call, path = load
    with pytest.raises(ConfigError) as raised, named_faults():
        call(0)
    assert str(raised.value) == f"--effects {path}: line 6, in inverse: ZeroDivisionError: division by zero: correct the file and run again"


def test_an_error_with_words_of_its_own_keeps_them_behind_the_place(load):
    call, _ = load
    with pytest.raises(ConfigError, match=r"line 5, in inverse: too large$"), named_faults():
        call(2)
    with pytest.raises(ConfigError, match=r"^--effects file: told already$"), named_faults():
        raise ConfigError("--effects file: told already")


def test_a_fault_elsewhere_passes_as_it_is(load):
    with pytest.raises(ZeroDivisionError) as raised, named_faults():
        1 / 0  # noqa: B018
    assert place_of(raised.value) == ""


def test_running_out_of_memory_is_no_fault_of_the_file(load):
    call, _ = load
    with pytest.raises(MemoryError), named_faults():
        call(9)


def test_a_file_that_does_not_parse_is_told_with_its_line(load):
    _, path = load
    with pytest.raises(SyntaxError) as raised:
        compile("x = 1\n1 +\n", str(path), "exec")
    assert fault(raised.value).startswith(f"--effects {path}: line 2: SyntaxError: invalid syntax")
