"""Where training rows are kept: in memory up to a budget, beyond it in memory-mapped files that the system may drop from memory.

Ten thousand recordings of four hundred rows and two hundred features are 3 GB; the arithmetic on mapped rows is the same, bit for bit.
"""

import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, final

import numpy as np
import torch
from torch import Tensor

from nnhydro.errors import CampaignError


@final
@dataclass
class RowStore:
    """Parts of rows, one tuple of columns a recording, appended in order; `columns()` gives each column whole. A context manager.

    `budget` bytes stay in memory; the files of what exceeds it lie in a folder made in `directory` and vanish with the store. By default
    that is the system's place for temporary files.
    """

    budget: int
    directory: Path | None = None
    _parts: list[tuple[Tensor, ...]] = field(default_factory=list)
    _files: list[Any] = field(default_factory=list)
    _layout: list[tuple[np.dtype[Any], tuple[int, ...]]] = field(default_factory=list)  # of one row of each column
    _rows: int = 0
    _bytes: int = 0
    _folder: Any = None

    def __enter__(self) -> "RowStore":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._parts.clear()
        for file in self._files:
            file.close()
        if self._folder is not None:
            self._folder.cleanup()

    @property
    def mapped(self) -> bool:
        """Whether rows lie in files."""
        return self._folder is not None

    def append(self, part: tuple[Tensor, ...]) -> None:
        """Add the columns of one part, each (m, ...) with the same m."""
        self._parts.append(part)
        self._layout = [(column.numpy().dtype, tuple(column.shape[1:])) for column in part]
        self._rows += len(part[0])
        self._bytes += sum(column.numel() * column.element_size() for column in part)
        if self._bytes > self.budget:
            self._spill()

    def _spill(self) -> None:
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix=".nnhydro_rows.", dir=self.directory)
            self._files = [(Path(self._folder.name) / f"{i}.rows").open("wb") for i in range(len(self._layout))]
        for part in self._parts:
            for file, column in zip(self._files, part, strict=True):
                file.write(column.contiguous().numpy().tobytes())
        self._parts.clear()
        self._bytes = self.budget  # once in files, every further part follows at once

    def columns(self) -> tuple[Tensor, ...]:
        """Return every column over all parts, in memory or mapped; raises CampaignError where there is no part."""
        if not self._rows:
            raise CampaignError("no recording holds a stretch of finite rows long enough to train on: see nnhydro check")
        if not self.mapped:
            return tuple(torch.cat(column) for column in zip(*self._parts, strict=True))
        self._spill()
        for file in self._files:
            file.flush()
        return tuple(torch.from_numpy(np.memmap(file.name, dtype, "r+", shape=(self._rows, *shape)))
                     for file, (dtype, shape) in zip(self._files, self._layout, strict=True))
