"""Registries: members declared in the files of one folder, so that a file is the whole registration of what it declares."""

import importlib
import pkgutil
from collections.abc import Sequence
from functools import cache
from typing import Generic, TypeVar, final

from nnhydro.errors import ConfigError

M = TypeVar("M")


@cache
def import_files(package: str) -> None:
    """Import every module of `package`, those of folders inside it too, so that what they declare is in memory."""
    for module in pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}."):
        importlib.import_module(module.name)


@final
class Registry(Generic[M]):
    """Members by name, each declared in a file of `package`; the files are imported when the members are first asked for."""

    def __init__(self, package: str) -> None:
        self.package = package
        self._members: dict[str, M] = {}

    def enter(self, name: str, member: M) -> None:
        """Take `member` as the one called `name`."""
        self._members[name] = member

    def members(self) -> dict[str, M]:
        """Return every declared member by name, in the order of names."""
        import_files(self.package)
        return dict(sorted(self._members.items()))

    def choose(self, names: Sequence[str], what: str) -> list[M]:
        """Return the members `names`; raises ConfigError, which calls a member `what`, for an unknown name."""
        known = self.members()
        unknown = [name for name in names if name not in known]
        if unknown:
            raise ConfigError(f"unknown {what} {unknown[0]!r}: known are {', '.join(known)}")
        return [known[name] for name in names]
