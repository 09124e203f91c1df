"""Columns that are kept: in memory up to a size, in a temporary folder beyond it, which goes with the store.

That of a process that was killed is removed by the next one that needs such a folder.
"""

import weakref
from collections.abc import Iterable
from itertools import count
from pathlib import Path
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.files import scratch

Array = NDArray[np.float64]
KEPT_BYTES = 200_000_000  # in memory


@final
class Store:
    """Keeps arrays; `kept` returns what stands for one: itself, or the file that holds it."""

    def __init__(self) -> None:
        self._bytes = 0
        self._folder: Path | None = None
        self._numbers = count()

    def kept(self, X: Array) -> Array | Path:
        """Return `X`, or the file that it was written to where memory holds enough."""
        if self._bytes + X.nbytes <= KEPT_BYTES:
            self._bytes += X.nbytes
            return X
        if self._folder is None:
            self._folder, remove = scratch("nnhydro_columns")
            weakref.finalize(self, remove)
        path = self._folder / f"{next(self._numbers)}.npy"
        np.save(path, X)
        return path

    def hold(self, wanted: Iterable[Array | Path]) -> None:
        """Drop all files but those among `wanted`, and count what of it is in memory."""
        held = {id(X): X for X in wanted}.values()
        if self._folder is not None:
            for path in set(self._folder.iterdir()) - {X for X in held if isinstance(X, Path)}:
                path.unlink()
        self._bytes = sum(X.nbytes for X in held if not isinstance(X, Path))
