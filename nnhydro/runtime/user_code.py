"""Python files of the user (--effects): an exception that arises in one is told in one line, with the file, the line and the function."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from nnhydro.errors import ConfigError, NnhydroError

REMEDY = "correct the file and run again"
_FILES: dict[str, Path] = {}  # by the name under which Python knows a file, as the user gave it


def register_user_file(path: Path) -> None:
    """Take `path` for a file of the user's own code."""
    _FILES[str(path.resolve())] = path


def place_of(cause: BaseException) -> str:
    """Return "--effects FILE: line N, in FUNCTION" of the innermost call in a file of the user; "" where `cause` passed through none."""
    if isinstance(cause, SyntaxError) and cause.filename and (file := _user_file(cause.filename)):
        return f"--effects {file}: line {cause.lineno}"
    calls = [(file, call) for call in traceback.extract_tb(cause.__traceback__) if (file := _user_file(call.filename))]
    if not calls:
        return ""
    file, call = calls[-1]
    return f"--effects {file}: line {call.lineno}" + ("" if call.name == "<module>" else f", in {call.name}")


def _user_file(filename: str) -> Path | None:
    """The file of the user that Python calls `filename`, as it was given; None for any other."""
    return _FILES.get(filename) or _FILES.get(str(Path(filename).resolve())) if _FILES else None


def fault(cause: Exception) -> str:
    """Return what went wrong in a file of the user, in one line."""
    said = cause.msg if isinstance(cause, SyntaxError) else str(cause)
    return f"{place_of(cause)}: {type(cause).__name__}: {said or 'no message'}: {REMEDY}"


@contextmanager
def named_faults() -> Iterator[None]:
    """Raise ConfigError with the place for an exception that passes through a file of the user; all others pass as they are."""
    try:
        yield
    except MemoryError:
        raise
    except NnhydroError as cause:
        place = place_of(cause)
        if not place or str(cause).startswith("--effects"):
            raise
        raise ConfigError(f"{place}: {cause}") from cause
    except Exception as cause:
        if not place_of(cause):
            raise
        raise ConfigError(fault(cause)) from cause
