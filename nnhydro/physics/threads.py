"""One thread for torch and for the linear algebra: on matrices of a few hundred rows threads cost more than they give."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep torch, BLAS and LAPACK on one thread inside the block, or inside a function decorated with `@one_thread()`."""
    import scipy.linalg  # noqa: F401  # only libraries that are loaded can be held
    from threadpoolctl import threadpool_limits

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with threadpool_limits(1):
            yield
    finally:
        torch.set_num_threads(before)
