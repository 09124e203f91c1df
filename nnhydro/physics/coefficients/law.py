"""What a coefficient law is: a factor on C_D and on C_M that depends on the state of the strip.

    C_D = curve(s/D) g_1 g_2 ...,     C_M likewise           [-]

Each factor is 1 in the conditions its file names, so that laws multiply. A file in this folder with a class that has a `kind` is the
whole registration; a law is written `kind` or `kind=number` in options and model files.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from math import pi
from typing import Any, ClassVar, final

import torch
from torch import Tensor

from nnhydro.errors import ModelError
from nnhydro.physics.carried import StepMemory
from nnhydro.physics.strips import Strips
from nnhydro.runtime.registry import choices, import_files


@final
@dataclass(frozen=True, eq=False)
class StripState:
    """What a law may depend on, strip by strip; `s_over_D` (n, links, s) is the travel in diameters."""

    strips: Strips
    s_over_D: Tensor

    @cached_property
    def Re(self) -> Tensor:  # (n, links, s)
        """Local Reynolds number |w| D / nu."""
        flow = self.strips.flow
        return self.strips.w.abs() * flow.D[:, None] / flow.nu

    @cached_property
    def KC(self) -> Tensor:  # (n, links, s)
        """Keulegan-Carpenter number 2 pi a / D of the stroke 2 a under way or, while that is shorter, of the one before."""
        s, carried = self.s_over_D, self.strips.flow.motion.carried
        if carried is not None:
            return pi * self._longest_stroke(s, carried)
        rows = torch.arange(len(s)).reshape(-1, 1, 1).expand_as(s)
        restart = torch.cat([torch.zeros_like(s[:1], dtype=torch.bool), s[1:] < s[:-1]])
        at = torch.where(restart, rows, torch.zeros_like(rows)).cummax(0).values
        before = torch.where(at > 0, s.gather(0, (at - 1).clamp(min=0)), torch.zeros_like(s))
        return pi * torch.maximum(s, before)

    def _longest_stroke(self, s: Tensor, carried: StepMemory) -> Tensor:
        """The stroke under way or, while that is shorter, the one before (n, links, s), of arms that are stepped through time."""

        def next_memory(old: Tensor) -> Tensor:
            return torch.stack([s, torch.where(s < old[..., 0], old[..., 0], old[..., 1])], dim=-1)

        strokes = carried.value(f"stroke/{self.strips.per_link}", lambda: torch.stack([s, torch.zeros_like(s)], dim=-1), next_memory)
        return torch.maximum(s, strokes[..., 1])

    @cached_property
    def L_over_D(self) -> Tensor:  # (links, 1)
        """Slenderness of each link."""
        return (self.strips.flow.L / self.strips.flow.D)[:, None]

    @cached_property
    def bend(self) -> Tensor:  # (n, links, 1) rad
        """Angle between each link and its inboard neighbour; 0 for the first link."""
        q = self.strips.flow.motion.q
        return torch.cat([torch.zeros_like(q[:, :1]), q[:, 1:]], dim=1)[..., None]

    @cached_property
    def h_over_D(self) -> Tensor:  # (links, 1)
        """Distance between the links' planes in diameters of each link."""
        return self.strips.flow.arm.parallel_distance_m / self.strips.flow.D[:, None]


@dataclass(frozen=True)
class Law(ABC):
    """A factor on the coefficients. Subclasses are final frozen dataclasses with at most one number."""

    kind: ClassVar[str] = ""

    @abstractmethod
    def drag(self, state: StripState) -> Tensor:
        """Return the factor on C_D, broadcastable to (n, links, s)."""

    @abstractmethod
    def added_mass(self, state: StripState) -> Tensor:
        """Return the factor on C_M, broadcastable to (n, links, s)."""


def law_kinds() -> Mapping[str, type[Law]]:
    """Return every law declared in this folder by its kind."""
    import_files("nnhydro.physics.coefficients")
    base: Any = Law  # mypy takes an abstract class for an instance to be made here
    return {cls.kind: cls for cls in sorted(base.__subclasses__(), key=lambda cls: str(cls.kind)) if cls.kind}


def law_of(text: str) -> Law:
    """Return the law written as `kind` or `kind=number`; raises ModelError listing the kinds."""
    kind, _, number = text.partition("=")
    kinds = law_kinds()
    if kind not in kinds:
        raise ModelError(f"unknown coefficient law {kind!r}: {choices(kind, kinds)}")
    try:
        return kinds[kind](*([float(number)] if number else []))
    except (TypeError, ValueError) as cause:
        how = f"{kind} or {kind}=number" if fields(kinds[kind]) else f"{kind} without a number"
        raise ModelError(f"coefficient law {text!r}: write {how}") from cause


def factors(laws: Sequence[str], state: StripState) -> tuple[Tensor, Tensor]:
    """Return the products of all `laws` on C_D and on C_M, broadcastable to (n, links, s)."""
    drag, added_mass = torch.ones(1, 1, 1, dtype=torch.float64), torch.ones(1, 1, 1, dtype=torch.float64)
    for law in map(law_of, laws):
        drag, added_mass = drag * law.drag(state), added_mass * law.added_mass(state)
    return drag, added_mass
