"""Interpolate printed tables: linear between the entries, constant beyond the first and the last."""

from collections.abc import Sequence

import torch
from torch import Tensor


def interpolate(x: Tensor, at: Sequence[float], values: Sequence[float]) -> Tensor:
    """Return the table's value at `x` (any shape); `at` increases; infinite x gives the last value."""
    grid, column = torch.tensor(at, dtype=torch.float64), torch.tensor(values, dtype=torch.float64)
    x = x.clamp(at[0], at[-1])
    right = torch.searchsorted(grid, x.contiguous()).clamp(1, len(at) - 1)
    share = (x - grid[right - 1]) / (grid[right] - grid[right - 1])
    return column[right - 1] + share * (column[right] - column[right - 1])


def interpolate_log(x: Tensor, at: Sequence[float], values: Sequence[float]) -> Tensor:
    """Return the table's value at `x` > 0, linear in log x."""
    grid = torch.tensor(at, dtype=torch.float64).log().tolist()
    return interpolate(x.clamp(min=at[0]).log(), grid, values)
