"""What the drag and the added mass of a strip may depend on: named sets of variables of the strip's own state, bounded and causal.

A function in a file of `features`, this folder included, marked by `state_set`, is one set. All variables are even: the mirror image of
the rig leaves them as they are, so that a load 1/2 rho D C(z) |w| w changes sign with w alone. A set of degree 3 enters the law (law.py)
with products of up to three of its variables, any two variables of all sets are multiplied. Source: Rivera (1995), eq. 3-1-24 (what C_D is
a function of).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import torch
from torch import Tensor

from nnhydro.features.wake import memories, stations, swinging_memories, time_memories, travel_memories
from nnhydro.physics.flow import Flow
from nnhydro.runtime.registry import Registry


@final
@dataclass(frozen=True, eq=False)
class StripView:
    """Strips of equal length on every link: x (links, s) m, normal velocity w and what the wake remembers, (n, links, s) m/s each."""

    flow: Flow

    @cached_property
    def x(self) -> Tensor:
        """Middles of the strips (links, s) m."""
        return stations(self.flow)

    @cached_property
    def _speeds(self) -> tuple[Tensor, list[Tensor]]:
        return memories(self.flow, self.x)

    @property
    def w(self) -> Tensor:
        """Normal velocity (n, links, s) m/s."""
        return self._speeds[0]

    @property
    def wake(self) -> list[Tensor]:
        """All that the stations carry from row to row, features/wake.py."""
        return self._speeds[1]

    @cached_property
    def travelled(self) -> list[Tensor]:
        """Memories over travel (n, links, s) m/s."""
        return travel_memories(self.wake)

    @cached_property
    def lasting(self) -> list[Tensor]:
        """Memories over time (n, links, s) m/s."""
        return time_memories(self.wake)

    @cached_property
    def swinging(self) -> list[Tensor]:
        """Both parts of the memory that swings (n, links, s) m/s."""
        return swinging_memories(self.wake)


StateSet = Callable[[StripView], Tensor]  # (n, links, k, s), even


@final
@dataclass(frozen=True)
class DeclaredSet:
    """A set and how many of its variables may be multiplied with each other."""

    variables: StateSet
    degree: int


_SETS: Registry[DeclaredSet] = Registry("nnhydro.features")


def state_set(name: str, degree: int = 2) -> Callable[[StateSet], StateSet]:
    """Declare the decorated function as the set `name` of strip variables."""

    def declare(function: StateSet) -> StateSet:
        _SETS.enter(name, DeclaredSet(function, degree))
        return function

    return declare


def state_sets() -> dict[str, DeclaredSet]:
    """Return every declared set by name."""
    return _SETS.members()


def known_states(names: Sequence[str]) -> list[DeclaredSet]:
    """Return the sets `names`; raises ConfigError for an unknown name."""
    return _SETS.choose(names, "set of strip variables")


def sets_of(view: StripView, names: Sequence[str]) -> list[int]:
    """Return the number of the set that each variable belongs to."""
    return [number for number, declared in enumerate(known_states(names)) for _ in range(declared.variables(view).shape[2])]


def strip_states(view: StripView, names: Sequence[str]) -> tuple[Tensor, tuple[int, ...]]:
    """Return the variables (n, links, k, s) of the sets `names` side by side, and which of them (indices) are of degree 3."""
    parts = [(declared.variables(view), declared.degree) for declared in known_states(names)]
    of_three = [degree > 2 for part, degree in parts for _ in range(part.shape[2])]
    z = torch.cat([part for part, _ in parts], dim=2) if parts else view.w[:, :, None][:, :, :0]
    return z, tuple(i for i, three in enumerate(of_three) if three)
