"""One run at a time into the same place: two that wrote the same results or checkpoints would lose one of them silently."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from nnhydro.errors import NnhydroError
from nnhydro.runtime.files import remove_leftovers, try_lock


class BusyError(NnhydroError):
    """Another run writes to the same place."""


def _hold(lock: Path) -> int | None:
    """Return the handle of the lock, None where another process holds it; made anew where its holder removed it meanwhile."""
    while True:
        lock.touch()
        handle = try_lock(lock)
        if handle is None:
            return None
        with suppress(FileNotFoundError):
            if os.fstat(handle).st_ino == lock.stat().st_ino:
                return handle
        os.close(handle)


@contextmanager
def only_run(out: Path) -> Iterator[None]:
    """Hold the place `out` (file or folder) inside the block; raises BusyError where another run does.

    The lock is an empty hidden file beside `out`. It vanishes with the block; what a killed run leaves of it holds nothing.
    """
    lock = out.parent / f".{out.name}.lock"
    above = [folder for folder in out.parents if not folder.exists()]
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        handle = _hold(lock)
    except OSError:  # nothing can be written there, so nothing can be lost: the command says so in its own words
        yield
        return
    if handle is None:
        raise BusyError(f"--out {out}: another nnhydro is at work there ({lock}): wait until it has finished, or name another place")
    try:
        remove_leftovers(out.parent)
        remove_leftovers(out)
        yield
    finally:
        lock.unlink(missing_ok=True)  # while it is held: whoever waits for it sees that it is gone
        os.close(handle)
        with suppress(OSError):  # folders that were made for the lock alone
            for folder in above:
                folder.rmdir()
