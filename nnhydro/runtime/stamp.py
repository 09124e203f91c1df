"""What nnhydro wrote: a hidden file in every folder of results lists them with their sha256, and nothing else is ever written over.

    {"schema": "nnhydro/written/1", "files": {"model.json": "9f3c...", "torques/run1.csv": "..."}, "whole": ["model.json"]}

Paths are told from the folder of the list. A file that is not on a list, or that was changed since, is somebody's own. Files that operating
systems leave by themselves do not count. What was written with its folder as a whole (a model, a campaign, results) is replaced with it
only, never as a single file. What the command that runs reads is not written over at all.
"""

import hashlib
import json
import os
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from nnhydro.errors import ConfigError

if sys.platform != "win32":
    import fcntl

STAMP = ".nnhydro_written.json"
SCHEMA = "nnhydro/written/1"
ARM_FILES = ("arm.yaml", "arm.yml")
CAMPAIGN_FILES = (*ARM_FILES, "columns.yaml", "columns.yml")
MODEL_FILES = ("model.json", "weights.safetensors", "digest.txt")  # parts of a whole also on lists of 0.2.0, which do not say what is
MEASURED = ("recordings", "steady")  # folders of a campaign in which every file is one that was measured
REMEDY = "move it away, or name another place"
_INPUTS: ContextVar[tuple[Path, ...]] = ContextVar("inputs", default=())  # of the command that runs, in full
_SYSTEM = re.compile(r"\.DS_Store|\._.*|Thumbs\.db|ehthumbs\.db|desktop\.ini|\$RECYCLE\.BIN|__MACOSX|~\$.*|\.~lock\..*#|"
                     r"\.nnhydro_written\.json.*|\..*\.nnhydro-.*|\..*\.lock", re.IGNORECASE)


def is_system_file(name: str) -> bool:
    """Return whether a file or folder called `name` was left by an operating system, an office program or nnhydro's own bookkeeping."""
    return _SYSTEM.fullmatch(name) is not None


def content_of(path: Path) -> str:
    """Return the sha256 of the file `path` in hex."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _read_stamp(folder: Path) -> tuple[dict[str, str], frozenset[str]]:
    """What the list in `folder` says: path in the folder to sha256, and the paths written as a whole; empty where none can be read."""
    try:
        document: Any = json.loads((folder / STAMP).read_text(encoding="utf-8"))
        files = document["files"] if document["schema"] == SCHEMA else {}
        return {str(name): str(digest) for name, digest in files.items()}, frozenset(map(str, document.get("whole", MODEL_FILES)))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}, frozenset()


def _read_list(folder: Path) -> dict[str, str]:
    return _read_stamp(folder)[0]


def stamp_text(files: dict[str, str], whole: Iterable[str] = ()) -> str:
    """Return the list of what was written, as it stands in a folder; `whole` are the paths that were written with the folder."""
    document = {"schema": SCHEMA, "files": dict(sorted(files.items())), "whole": sorted(set(whole) & files.keys())}
    return json.dumps(document, indent=1) + "\n"


def _content(folder: Path) -> Iterable[Path]:
    """Every file and link below `folder` that is no system's; links are not followed."""
    for place, folders, names in os.walk(folder):
        here = Path(place)
        yield from (here / name for name in [*names, *(name for name in folders if (here / name).is_symlink())] if not is_system_file(name))
        folders[:] = [name for name in folders if not is_system_file(name)]


def stamp_folder(folder: Path) -> None:
    """List every file of `folder` as written by nnhydro."""
    files = {path.relative_to(folder).as_posix(): content_of(path) for path in _content(folder) if path.is_file()}
    (folder / STAMP).write_text(stamp_text(files, files), encoding="utf-8")


def is_ours(path: Path, top: Path | None = None) -> bool:
    """Return whether nnhydro wrote the file `path` as it is: it stands on the list of its folder, or of one above up to `top`."""
    if path.is_symlink() or not path.is_file():
        return False
    digest, folder = "", path.parent
    while True:
        listed = _read_list(folder).get(path.relative_to(folder).as_posix())
        if listed is not None:
            digest = digest or content_of(path)
            if listed == digest:
                return True
        if top is None or folder == top or folder == folder.parent:
            return False
        folder = folder.parent


def foreign_file(folder: Path) -> Path | None:
    """Return a file in `folder` that nnhydro did not write, or that was changed since; None where all are its own."""
    lists: dict[Path, dict[str, str]] = {}
    for path in _content(folder):
        above = [parent for parent in path.parents if parent == folder or folder in parent.parents]
        said = {lists.setdefault(parent, _read_list(parent)).get(path.relative_to(parent).as_posix()) for parent in above} - {None}
        if path.is_symlink() or not said or content_of(path) not in said:
            return path
    return None


def refuse_among_recordings(out: Path, option: str = "--out") -> None:
    """Raise ConfigError where the folder `out` lies in recordings/ or steady/ of a campaign: results would be read as runs."""
    whole = Path(os.path.abspath(out))
    for folder in (whole, *whole.parents):
        if folder.name in MEASURED and any((folder.parent / name).is_file() for name in ARM_FILES):
            raise ConfigError(f"{option} {out}: in {folder.name}/ of a campaign every file is read as a recording: name a place outside "
                              "of it")


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a text that is no path: too long, or with a zero byte in it
        return False


@contextmanager
def reading(inputs: Iterable[Path]) -> Iterator[None]:
    """Take every file and folder of `inputs` that exists for an input of the command inside the block: none is written over."""
    token = _INPUTS.set(tuple(path.resolve() for path in inputs if _exists(path)))
    try:
        yield
    finally:
        _INPUTS.reset(token)


def refuse_inputs(out: Path, inputs: Iterable[Path] = ()) -> None:
    """Raise ConfigError where the folder `out`, which would be replaced whole, is or holds an input of the command."""
    whole, sources = out.resolve(), (*_INPUTS.get(), *(source.resolve() for source in inputs if _exists(source)))
    lost = next((source for source in sources if out.exists() and (source == whole or whole in source.parents)), None)
    if lost is not None:
        raise ConfigError(f"--out {out}: would be replaced whole, and {lost}, which the command reads, would be lost: name another folder")


def _refuse_part_of_whole(path: Path) -> None:
    """Raise ConfigError where the file `path` belongs to a campaign, a model or results, which would be spoilt without it."""
    folder = path.parent
    if path.name in CAMPAIGN_FILES and any((folder / name).is_dir() for name in MEASURED):
        raise ConfigError(f"--out: {path} describes the campaign in {folder}, which would be lost: name another file")
    if path.name in _read_stamp(folder)[1]:
        raise ConfigError(f"--out: {path} is part of what nnhydro wrote to {folder} as a whole (a model, a campaign or results): "
                          "name another file")


def refuse_foreign(path: Path, inputs: Iterable[Path] = ()) -> None:
    """Raise ConfigError where `path` exists and nnhydro may not write over it.

    That is an input of the command, a part of a campaign, of a model or of results, or a file that nnhydro did not write.
    """
    if path.exists() and any(source.exists() and path.samefile(source) for source in (*_INPUTS.get(), *inputs)):
        raise ConfigError(f"--out: {path} is one of the inputs, which would be lost: name another place")
    refuse_among_recordings(path.parent)
    if not (path.exists() or path.is_symlink()):
        return
    if path.is_dir():
        raise ConfigError(f"--out {path}: is a folder: name a file")
    if not is_ours(path):
        raise ConfigError(f"--out: {path} is there already, and nnhydro did not write it (or it was changed since): {REMEDY}")
    _refuse_part_of_whole(path)


@contextmanager
def _locked_list(folder: Path) -> Iterator[None]:
    """Hold the list of `folder` inside the block: others that add to it wait. Where the file system knows no locks nobody waits."""
    if sys.platform == "win32":
        yield
        return
    lock = folder / f"{STAMP}.lock"
    while True:
        handle = os.open(lock, os.O_RDWR | os.O_CREAT, 0o644)
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        with suppress(FileNotFoundError):
            if os.fstat(handle).st_ino == lock.stat().st_ino:
                break
        os.close(handle)  # its holder removed it meanwhile
    try:
        yield
    finally:
        lock.unlink(missing_ok=True)
        os.close(handle)


def stamp_file(path: Path) -> None:
    """Add the file `path`, just written, to the list in its folder, whole or not at all; several processes may do so at once."""
    with _locked_list(path.parent):
        files, whole = _read_stamp(path.parent)
        files = {name: digest for name, digest in files.items() if (path.parent / name).exists()} | {path.name: content_of(path)}
        made = path.parent / f"{STAMP}.{os.getpid()}.new"
        made.write_text(stamp_text(files, whole), encoding="utf-8")
        made.replace(path.parent / STAMP)
