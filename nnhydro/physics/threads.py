"""Torch's threads: on tensors of a few thousand rows they cost more than they give, and on busy cores a hundred times as much."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep torch on one thread inside the block, or inside a function decorated with `@one_thread()`."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
