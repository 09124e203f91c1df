"""Files that appear whole or not at all: written under a temporary name beside the target, then renamed."""

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from nnhydro.errors import ConfigError, require


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path`, whole or not at all; the folder is made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(name, 0o644)  # mkstemp makes files that nobody else may read
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def json_text(document: Any) -> str:
    """Return `document` as JSON text; NaN and infinity, which JSON does not know, are refused."""
    return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def write_json(path: Path, document: Any) -> None:
    """Write `document` as JSON to `path`, whole or not at all."""
    write_text(path, json_text(document))


def _ours(out: Path, marker: str) -> bool:
    return not any(out.iterdir()) or (out / marker).exists()


def check_folder(out: Path, marker: str) -> None:
    """Raise ConfigError where `whole_folder` could not make or replace `out`: asked before long work, so that none is lost."""
    require(not out.exists() or out.is_dir(), f"--out {out}: is a file: name a folder")
    there = next(folder for folder in (out, *out.absolute().parents) if folder.exists())
    require(there.is_dir(), f"--out {out}: cannot be made, for {there} is a file: name another place")
    writable = there if there != out else out.absolute().parent  # a folder is replaced beside itself
    require(os.access(writable, os.W_OK | os.X_OK) and os.access(there, os.R_OK | os.X_OK),
            f"--out {out}: {writable} may not be written to: name a folder where you may write")
    require(not out.exists() or _ours(out, marker), f"--out {out}: holds other files (no {marker}): name a new or empty folder")


@contextmanager
def whole_folder(out: Path, marker: str) -> Iterator[Path]:
    """Yield an empty folder that becomes `out` when the block ends well and vanishes when it does not.

    An existing `out` is replaced whole, but only if it is empty or holds `marker`, the file by which such folders are known: a folder
    of somebody's own files is refused (ConfigError).
    """
    check_folder(out, marker)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(dir=out.parent, prefix=f".{out.name}."))
    except OSError as cause:
        raise ConfigError(f"--out {out}: cannot be made ({cause.strerror or cause}): name a folder that you may write to") from cause
    try:
        os.chmod(work, 0o755)
        yield work
        (work / marker).touch()
        if out.exists():
            old = Path(tempfile.mkdtemp(dir=out.parent, prefix=f".{out.name}.old."))
            os.replace(out, old / "old")
            os.replace(work, out)
            shutil.rmtree(old)
        else:
            os.replace(work, out)
    finally:
        shutil.rmtree(work, ignore_errors=True)
