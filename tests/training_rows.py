"""Rows of a training that nobody recorded."""

import torch

from nnhydro.fitting.network.rows import Rows


def some_rows(n=60, units=6, joints=2, seed=1, linear=False):
    """Rows whose target is a product of two inputs, with noise."""
    generator = torch.Generator().manual_seed(seed)
    parity = torch.tensor([-1.0, 1.0, -1.0])
    x = torch.randn(n, 3, generator=generator)
    target = 2 * x[:, [0]] * (1 + 0.5 * x[:, [1]]) + 0.1 * torch.randn(n, joints, generator=generator)
    scale = 0.5 + torch.rand(n, joints, generator=generator)
    part = 0.1 * torch.randn(n, 2, joints, generator=generator) if linear else None
    return Rows(x, parity, scale, target, torch.arange(n) % units, part)


def watched_rows(n=400, units=8, seed=1):
    """Such rows with a linear part that gives nothing."""
    rows = some_rows(n, units, seed=seed)
    return Rows(rows.x, rows.parity, rows.scale, rows.target, rows.unit, torch.zeros(n, 2, 2))
