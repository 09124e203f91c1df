"""Files and folders that appear whole or not at all: written under a temporary name beside the target, made durable, then renamed.

What a run that was ended from outside (kill -9, power cut) leaves under a temporary name is removed by the next one into the same place;
a temporary folder is locked by the process that fills it, so that nobody else's is taken for a leftover.
"""

import json
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from nnhydro.errors import ConfigError, NnhydroError, require
from nnhydro.runtime.stamp import (
    REMEDY,
    foreign_file,
    is_system_file,
    refuse_among_recordings,
    refuse_foreign,
    refuse_inputs,
    stamp_file,
    stamp_folder,
)

if sys.platform != "win32":
    import fcntl

UNDER_WAY = ".nnhydro-"  # in the name of what is being written: no name that somebody would give to a file of his own
OLD = "old"
LARGEST_JSON = 200_000_000  # bytes: nothing that nnhydro writes is larger
AT_HERE, EXCHANGE = -100, 2  # AT_FDCWD, RENAME_EXCHANGE of renameat2(2)


def try_lock(path: Path) -> int | None:
    """Return a handle that holds `path` (file or folder) for this process, None where another one holds it.

    The system lets go of it when the handle is closed or the process ends, however it ends. Raises OSError where the file system knows
    no locks; on Windows nothing is held.
    """
    handle = os.open(path, os.O_RDONLY)
    if sys.platform != "win32":
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as cause:
            os.close(handle)
            if isinstance(cause, BlockingIOError):
                return None
            raise
    return handle


def _prefix(target: Path) -> str:
    return f".{target.name}{UNDER_WAY}"


def remove_leftovers(folder: Path) -> None:
    """Remove what runs that were ended from outside left under temporary names in `folder`; what a running one holds stays."""
    for left in folder.iterdir() if folder.is_dir() else ():
        if not left.name.startswith(".") or UNDER_WAY not in left.name:
            continue
        with suppress(OSError):  # whoever may not remove it can work beside it
            handle = try_lock(left)
            if handle is None:
                continue
            target = folder / left.name[1:].partition(UNDER_WAY)[0]
            if (left / OLD).exists() and not target.exists():  # killed while the two could not change places in one step
                os.replace(left / OLD, target)
            shutil.rmtree(left) if left.is_dir() else left.unlink()
            os.close(handle)


def _temporary(target: Path, folder: bool) -> tuple[Path, int | None]:
    """Make an empty file or folder beside `target` and hold it, so that nobody takes it for a leftover; return it and the handle."""
    while True:
        if folder:
            made = Path(tempfile.mkdtemp(dir=target.parent, prefix=_prefix(target)))
        else:
            handle, name = tempfile.mkstemp(dir=target.parent, prefix=_prefix(target))
            os.close(handle)
            made = Path(name)
        try:
            lock = try_lock(made)
        except FileNotFoundError:  # taken for a leftover before it was held
            continue
        except OSError:  # a file system without locks: nobody removes leftovers there either
            return made, None
        if lock is not None:
            return made, lock


def scratch(purpose: str) -> tuple[Path, Callable[[], None]]:
    """Return an empty folder among the system's temporary files, held by this process, and the function that removes it.

    Those that killed processes left there are removed first.
    """
    place = Path(tempfile.gettempdir())
    remove_leftovers(place)
    made, lock = _temporary(place / purpose, folder=True)

    def remove() -> None:
        """Remove the folder and let go of its lock."""
        shutil.rmtree(made, ignore_errors=True)
        if lock is not None:
            os.close(lock)

    return made, remove


def write_bytes(path: Path, content: bytes, mode: int = 0o644) -> None:
    """Write `content` to `path`, whole or not at all; the folder is made. `mode` says who may read it, from the first byte on."""
    path.parent.mkdir(parents=True, exist_ok=True)
    made, lock = _temporary(path, folder=False)  # nobody else may read it yet
    try:
        with made.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        made.chmod(mode)
        made.replace(path)
    except BaseException:
        made.unlink(missing_ok=True)
        raise
    finally:
        if lock is not None:
            os.close(lock)


def write_text(path: Path, text: str, mode: int = 0o644) -> None:
    """Write `text` to `path` as UTF-8, whole or not at all; the folder is made."""
    write_bytes(path, text.encode(), mode)


def json_text(document: Any) -> str:
    """Return `document` as JSON text; NaN and infinity, which JSON does not know, are refused."""
    return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def comment_text(text: str) -> str:
    """Return `text`, which may come from a file of others, so that it does not end the comment of C or XML that it stands in."""
    printable = "".join(letter if letter.isprintable() or letter == "\n" else "\N{REPLACEMENT CHARACTER}" for letter in text)
    return re.sub(r"\*(?=/)|/(?=\*)|-(?=-)", r"\g<0> ", printable)


def _no_number(constant: str) -> None:
    raise ValueError(f"{constant} is not a number in JSON")


def read_json(path: Path, error: type[NnhydroError], largest: int = LARGEST_JSON) -> dict[str, Any]:
    """Return the JSON object in `path`; raise `error` with one line where it is missing, larger than `largest` bytes or no JSON object."""
    try:
        if not path.is_file():
            raise error(f"{path}: {'is not a file' if path.exists() else 'does not exist'}: check the path")
        if path.stat().st_size > largest:
            raise error(f"{path}: holds more than {largest} bytes: is this the right file?")
        document = json.loads(path.read_text(encoding="utf-8"), parse_constant=_no_number)
    except OSError as cause:
        raise error(f"{path}: cannot be read ({cause.strerror or cause}): check the path and its permissions") from cause
    except (ValueError, RecursionError) as cause:
        raise error(f"{path}: is not valid JSON ({str(cause)[:200]}): write it again") from cause
    if not isinstance(document, dict):
        raise error(f"{path}: holds a {type(document).__name__} instead of a JSON object: is this the right file?")
    return document


def write_json(path: Path, document: Any) -> None:
    """Write `document` as JSON to `path`, whole or not at all."""
    write_text(path, json_text(document))


def write_output(path: Path, content: str | bytes, inputs: Iterable[Path] = ()) -> Path:
    """Write a file of results to `path`, whole or not at all, and list it as nnhydro's (stamp.py); returns `path`.

    Raises ConfigError where `path` is one of the command's `inputs`, or holds what nnhydro did not write, or cannot be written to.
    """
    refuse_foreign(path, inputs)
    try:
        write_bytes(path, content if isinstance(content, bytes) else content.encode())
        stamp_file(path)
    except OSError as cause:
        raise ConfigError(f"--out: {path} cannot be written ({cause.strerror or cause}): name a place where you may write") from cause
    return path


def _require_ours(out: Path, marker: str) -> None:
    """Raise ConfigError where the folder `out` holds anything but results that may be replaced."""
    if all(is_system_file(path.name) for path in out.iterdir()):
        return
    require((out / marker).exists(), f"--out {out}: holds other files (no {marker}): name a new or empty folder")
    foreign = foreign_file(out)
    require(foreign is None, f"--out {out}: would be replaced whole, but nnhydro did not write {foreign} (or it was changed since): "
            f"{REMEDY}")


def check_folder(out: Path, marker: str) -> None:
    """Raise ConfigError where `whole_folder` could not make or replace `out`: asked before long work, so that none is lost."""
    require(not out.exists() or out.is_dir(), f"--out {out}: is a file: name a folder")
    refuse_among_recordings(out)
    there = next(folder for folder in (out, *out.absolute().parents) if folder.exists())
    require(there.is_dir(), f"--out {out}: cannot be made, for {there} is a file: name another place")
    writable = there if there != out else out.absolute().parent  # a folder is replaced beside itself
    require(os.access(writable, os.W_OK | os.X_OK) and os.access(there, os.R_OK | os.X_OK),
            f"--out {out}: {writable} may not be written to: name a folder where you may write")
    if out.exists():
        _require_ours(out, marker)
        refuse_inputs(out)


def _exchange(first: Path, second: Path) -> bool:
    """Let two folders change places in one step; False where the system cannot."""
    if not sys.platform.startswith("linux"):
        return False
    import ctypes

    rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    return rename is not None and rename(AT_HERE, os.fsencode(first), AT_HERE, os.fsencode(second), EXCHANGE) == 0


def _replace(out: Path, work: Path) -> None:
    """Put the folder `work` in the place of `out`."""
    if not out.exists():
        os.replace(work, out)
    elif _exchange(work, out):
        shutil.rmtree(work)  # the old folder now
    else:
        old = Path(tempfile.mkdtemp(dir=out.parent, prefix=_prefix(out)))
        os.replace(out, old / OLD)
        os.replace(work, out)
        shutil.rmtree(old)


def _durable(folder: Path) -> None:
    """Have every file below `folder` on the disk before its name is."""
    for path in (*folder.rglob("*"), folder):
        with suppress(PermissionError):  # Windows opens no folder
            handle = os.open(path, os.O_RDONLY)
            os.fsync(handle)
            os.close(handle)


@contextmanager
def whole_folder(out: Path, marker: str) -> Iterator[Path]:
    """Yield an empty folder that becomes `out` when the block ends well and vanishes when it does not.

    An existing `out` is replaced whole, but only if it is empty, or holds `marker`, the file by which such folders are known, and nothing
    that nnhydro did not write (stamp.py): a folder with somebody's own files is refused (ConfigError).
    """
    out = out.resolve() if out.is_symlink() else out  # what a link points to is replaced, not the link
    remove_leftovers(out.parent)
    check_folder(out, marker)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        work, lock = _temporary(out, folder=True)
    except OSError as cause:
        raise ConfigError(f"--out {out}: cannot be made ({cause.strerror or cause}): name a folder that you may write to") from cause
    try:
        work.chmod(0o755)
        yield work
        (work / marker).touch()
        stamp_folder(work)
        _durable(work)
        check_folder(out, marker)  # again: the work may have taken hours
        _replace(out, work)
    finally:
        shutil.rmtree(work, ignore_errors=True)
        if lock is not None:
            os.close(lock)
