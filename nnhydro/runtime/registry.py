"""Registries: members declared in the files of one folder, so that a file is the whole registration of what it declares.

Whoever asks for a name that nobody declared is told the nearest one: `choices`, for names of any kind.
"""

import importlib
import pkgutil
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from functools import cache
from typing import Generic, TypeVar, final

from nnhydro.errors import ConfigError

M = TypeVar("M")
SAME, NEAR = 0.85, 0.75  # ratio of difflib from which one name is meant, and from which a name is near
FEW, MOST = 8, 60  # names that are listed beside the nearest one, and without one


@cache
def import_files(package: str) -> None:
    """Import every module of `package`, those of folders inside it too, so that what they declare is in memory."""
    for module in pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}."):
        importlib.import_module(module.name)


def nearest(name: str, known: Iterable[str]) -> list[str]:
    """Return up to three of the `known` names that `name` may stand for: near in spelling, or with `name` as one of their words."""
    plain = {other.casefold().replace("-", "_"): other for other in known}
    asked = name.casefold().replace("-", "_").strip()
    same = get_close_matches(asked, plain, n=1, cutoff=SAME)
    if same:
        return [plain[same[0]]]
    worded = [other for other in plain if asked and f"_{asked}_" in f"_{other}_"]
    return [plain[other] for other in dict.fromkeys([*get_close_matches(asked, plain, n=3, cutoff=NEAR), *worded,
                                                     *get_close_matches(asked, plain, n=1)])][:3]


def choices(name: str, known: Iterable[str]) -> str:
    """Return what a message proposes in place of the unknown `name`: the nearest of the `known` names, and all where they are few."""
    names = list(known)
    near = nearest(name[:100], names)
    listed = f"{', '.join(names[:MOST])}{', ...' if len(names) > MOST else ''}"
    if not near:
        return f"choose one of {listed}"
    return f"did you mean {' or '.join(map(repr, near))}?" + (f" Known are {listed}" if len(names) <= FEW else "")


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
            raise ConfigError(f"unknown {what} {unknown[0]!r}: {choices(unknown[0], known)}")
        return [known[name] for name in names]
