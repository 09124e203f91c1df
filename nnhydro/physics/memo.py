"""Memoisation: values that many hypotheses about one motion share are computed once, when first asked for."""

from collections.abc import Callable, Hashable
from typing import Any, TypeVar, final

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
