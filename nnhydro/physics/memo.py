"""Memoisation: values that many hypotheses about one motion share, or many fits to one recording, are computed once."""

import hashlib
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable
from typing import Any, TypeVar, final

from torch import Tensor

T = TypeVar("T")


@final
class Memo:
    """A store of computed values by key."""

    def __init__(self) -> None:
        self._known: dict[Hashable, Any] = {}

    def of(self, key: Hashable, compute: Callable[[], T]) -> T:
        """Return what `compute` gives, which is called the first time only that `key` is asked for."""
        if key not in self._known:
            self._known[key] = compute()
        found: T = self._known[key]
        return found


@final
class RecentMemo:
    """A store of computed values by key that keeps those last asked for, `most` bytes in all."""

    def __init__(self, most: int) -> None:
        self._most, self._bytes = most, 0
        self._known: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()

    def of(self, key: Hashable, compute: Callable[[], T], size: Callable[[T], int]) -> T:
        """Return what `compute` gives, called where `key` is not known (any more); `size` tells the bytes that keeping it takes."""
        if key in self._known:
            self._known.move_to_end(key)
            known: T = self._known[key][0]
            return known
        found = compute()
        self._known[key] = found, size(found)
        self._bytes += size(found)
        while self._bytes > self._most:
            self._bytes -= self._known.popitem(last=False)[1][1]
        return found


def content_of(tensors: Iterable[Tensor | None]) -> bytes:
    """Return a digest of the numbers in `tensors` and of their shapes; None counts as a tensor of its own."""
    digest = hashlib.blake2b()
    for x in tensors:
        digest.update(b"none" if x is None else repr((x.dtype, tuple(x.shape))).encode())
        digest.update(b"" if x is None else x.detach().contiguous().numpy().tobytes())
    return digest.digest()
