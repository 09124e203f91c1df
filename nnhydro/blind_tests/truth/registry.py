"""Hidden causes by name: a file hidden_*.py in this folder declares its causes with `@hides(...)`; nothing else lists them."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from functools import cache
from pathlib import Path

from nnhydro.blind_tests.truth.world import Draft, Generator, TrueArm

Maker = Callable[[Generator, TrueArm], Draft]
_MAKERS: dict[str, Maker] = {}
_TWO_LINKS: set[str] = set()
_NO_BELT: set[str] = set()
_BY_NAME: set[str] = set()


def hides(name: str, two_links: bool = False, no_belt: bool = False, by_name: bool = False) -> Callable[[Maker], Maker]:
    """Register a maker under `name`: it draws all but the size. `two_links`: needs them; `no_belt`: sits at a direct drive.

    `by_name`: hidden where it is asked for alone, so that campaigns drawn at random by an earlier version can be made again.
    """
    def register(maker: Maker) -> Maker:
        """Enter `maker` under its name."""
        _MAKERS[name] = maker
        _TWO_LINKS.update([name] if two_links else [])
        _NO_BELT.update([name] if no_belt else [])
        _BY_NAME.update([name] if by_name else [])
        return maker
    return register


@cache
def makers() -> dict[str, Maker]:
    """Return all makers: effects of the catalogue by id, "unlisted:..." and "base_form:..."."""
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        if module.name.startswith("hidden_"):
            importlib.import_module(f"{__package__}.{module.name}")
    return dict(sorted(_MAKERS.items()))


def names(kind: str = "", links: int = 2) -> tuple[str, ...]:
    """Return the names of one kind ("": the catalogue; "unlisted", "base_form") that an arm of `links` links can have."""
    return tuple(name for name in makers() if name.rpartition(":")[0] == kind and (links > 1 or name not in _TWO_LINKS))


def random_names(links: int) -> tuple[str, ...]:
    """Return the effects of the catalogue that are hidden at random on an arm of `links` links."""
    return tuple(name for name in names("", links) if name not in _BY_NAME)


def takes_belt(name: str) -> bool:
    """Return whether the cause may sit on a belt-driven arm."""
    makers()
    return name not in _NO_BELT


def draw_joint(rng: Generator, arm: TrueArm) -> int:
    """Return a joint, counted from 1."""
    return int(rng.integers(len(arm.links))) + 1
