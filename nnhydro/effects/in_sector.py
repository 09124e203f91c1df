"""What acts while one joint lies in a sector of its angles: a cable that catches, a seal or a gear that rubs on one side."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any, TypeVar, final

from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect
from nnhydro.effects.sensor_view import SensorView
from nnhydro.errors import ModelError, require
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LoadTerm, term_of

Angles = TypeVar("Angles", bound=Any)  # an array or a tensor


def within(q: Angles, low: float | None, high: float | None) -> Angles:
    """Return low <= q < high for angles (n, ...) rad, element by element; None: open to that side."""
    inside: Angles = (q >= (-inf if low is None else low)) & (q < (inf if high is None else high))
    return inside


def _numbers(*ends: float | None) -> bool:
    return all(x is None or (isinstance(x, float | int) and not isinstance(x, bool) and isfinite(x)) for x in ends)


@final
@dataclass(frozen=True)
class InSector(LoadTerm):
    """tau = [low <= q_j < high] tau(term); j counts from 1, angles in rad, None where open. Raises ModelError without such a joint."""

    kind = "in_sector"

    joint: int
    low: float | None
    high: float | None
    term: LoadTerm

    def __post_init__(self) -> None:
        if isinstance(self.term, Mapping):
            object.__setattr__(self, "term", term_of(self.term))
        whole = isinstance(self.joint, int) and not isinstance(self.joint, bool) and self.joint >= 1
        fits = whole and _numbers(self.low, self.high) and isinstance(self.term, LoadTerm)
        require(fits, "term 'in_sector': needs joint (from 1), low, high and term", ModelError)
        super().__post_init__()

    def torque(self, flow: Flow) -> Tensor:
        """Return the torque (n, joints) N m of the term, 0 outside the sector."""
        require(self.joint <= flow.arm.n_links, f"term 'in_sector': joint {self.joint}: this arm has {flow.arm.n_links}", ModelError)
        return self.term.torque(flow) * within(flow.motion.q[:, self.joint - 1:self.joint], self.low, self.high)

    def document(self) -> dict[str, Any]:
        """Return the term as model files store it."""
        return {"kind": self.kind, "parameters": {},
                "options": {"joint": self.joint, "low": self.low, "high": self.high, "term": self.term.document()}}


@final
@dataclass(frozen=True)
class ReadInSector(InstrumentEffect):
    """tau -> tau + [low <= q_j < high] (reading(effect) - tau); j counts from 1, angles in rad, None where open.

    Raises ModelError where the effect is no fault of sensors or drives that acts everywhere.
    """

    kind = "read_in_sector"
    acts = "joint"

    low: float | None
    high: float | None
    effect: InstrumentEffect

    def __post_init__(self) -> None:
        fits = _numbers(self.low, self.high) and isinstance(self.effect, InstrumentEffect) and not isinstance(self.effect, ReadInSector)
        require(fits, "effect 'read_in_sector': needs joint (from 1), low, high and an effect that acts everywhere", ModelError)
        for name in ("id", "stage"):  # those of the effect: it takes its place among the others
            object.__setattr__(self, name, getattr(self.effect, name))
        super().__post_init__()

    def _acts(self, seen: SensorView) -> Tensor:
        require(self.joint <= seen.arm.n_links, f"effect 'read_in_sector': joint {self.joint}: this arm has {seen.arm.n_links}", ModelError)
        return within(seen.motion.q[:, self.joint - 1:self.joint], self.low, self.high)

    def columns(self, seen: SensorView) -> Tensor:
        """Return the columns of the effect (n, joints, p), 0 outside the sector."""
        return self.effect.columns(seen) * self._acts(seen)[..., None]

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading (n, joints) N m, outside the sector without the effect."""
        return seen.tau + (self.effect.apply(seen) - seen.tau) * self._acts(seen)

    def document(self) -> dict[str, Any]:
        """Return it as model files store it."""
        return {"kind": self.kind, "parameters": {},
                "options": {"joint": self.joint, "low": self.low, "high": self.high, "effect": self.effect.document()}}
