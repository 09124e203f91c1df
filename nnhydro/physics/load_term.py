"""What a load term is: a named cause that adds torque at the joints (LOAD: what the drive must supply).

A term declares its parameters once, as dataclass fields made by `parameter`; fits, tables, reports and model files read unit, bounds and
meaning there. A file in physics/loads is the whole registration of its terms.
"""

import importlib
import pkgutil
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from typing import Any, ClassVar, Self, final

import torch
from torch import Tensor

from nnhydro.errors import ModelError, require
from nnhydro.physics.flow import Flow
from nnhydro.recordings.arm import Arm

Values = tuple[float, ...]
PER = ("link", "joint", "arm")


def parameter(unit: str, start: float, bounds: tuple[float, float], meaning: str, per: str = "link", linear: bool = True) -> Any:
    """Return a dataclass field for a parameter of a load term: a tuple with one value a link, a joint, or one for the arm.

    `start` is where fits begin, `bounds` what physics allows, `linear` whether the torque is proportional to it.
    """
    require(per in PER, f"parameter is per {per!r}: one of {PER}")
    card = {"unit": unit, "start": start, "bounds": bounds, "meaning": meaning, "per": per, "linear": linear}
    return field(default=MISSING, metadata=card)


@dataclass(frozen=True)
class LoadTerm(ABC):
    """A cause of joint torque. Subclasses are final frozen dataclasses; their fields made by `parameter` are tuples of floats."""

    kind: ClassVar[str] = ""  # name in model files

    @abstractmethod
    def torque(self, flow: Flow) -> Tensor:
        """Return the joint torques (n, joints) N m for one run in time order."""

    def __post_init__(self) -> None:
        for f in self.parameters():
            values = getattr(self, f.name)
            try:
                object.__setattr__(self, f.name, tuple(float(v) for v in values))
            except (TypeError, ValueError) as cause:
                raise ModelError(f"term {self.kind!r}: {f.name} = {values!r} is not a list of numbers") from cause

    @classmethod
    def parameters(cls) -> tuple["Field[Any]", ...]:
        """Return the dataclass fields that `parameter` made."""
        return tuple(f for f in fields(cls) if "unit" in f.metadata)

    @classmethod
    def options(cls) -> tuple["Field[Any]", ...]:
        """Return the other dataclass fields: choices, not numbers to fit."""
        return tuple(f for f in fields(cls) if "unit" not in f.metadata)

    @classmethod
    def started(cls, arm: Arm, **options: Any) -> Self:
        """Return the term with every parameter at its start value, sized for `arm`."""
        sizes = {"link": arm.n_links, "joint": arm.n_links, "arm": 1}
        return cls(**{f.name: (f.metadata["start"],) * sizes[f.metadata["per"]] for f in cls.parameters()}, **options)

    def document(self) -> dict[str, Any]:
        """Return the term as model files store it."""
        return {"kind": self.kind, "parameters": {f.name: list(getattr(self, f.name)) for f in self.parameters()},
                "options": {f.name: getattr(self, f.name) for f in self.options()}}


@dataclass(frozen=True)
class LinearTerm(LoadTerm):
    """A term whose torque is proportional to its linear parameters: torque = sum_p columns_p(flow) value_p."""

    @abstractmethod
    def columns(self, flow: Flow) -> Tensor:
        """Return d torque / d linear parameter, (n, joints, p), p in the order of `linear_names`."""

    def linear_fields(self) -> tuple["Field[Any]", ...]:
        """Return the fields whose values enter linearly."""
        return tuple(f for f in self.parameters() if f.metadata["linear"])

    @final
    def linear_names(self) -> tuple[str, ...]:
        """Return one name a linear parameter, `C_D[1]` for the first link."""
        return tuple(f"{f.name}[{i + 1}]" if len(getattr(self, f.name)) > 1 or f.metadata["per"] != "arm" else f.name
                     for f in self.linear_fields() for i in range(len(getattr(self, f.name))))

    @final
    def linear_values(self) -> Tensor:
        """Return the linear parameters as one vector (p,)."""
        return torch.tensor([v for f in self.linear_fields() for v in getattr(self, f.name)], dtype=torch.float64)

    @final
    def linear_bounds(self) -> tuple[tuple[float, float], ...]:
        """Return (lowest, highest) of each linear parameter."""
        return tuple(f.metadata["bounds"] for f in self.linear_fields() for _ in getattr(self, f.name))

    @final
    def linear_units(self) -> tuple[str, ...]:
        """Return the unit of each linear parameter."""
        return tuple(f.metadata["unit"] for f in self.linear_fields() for _ in getattr(self, f.name))

    @final
    def with_linear(self, values: Tensor) -> Self:
        """Return the term with its linear parameters replaced by `values` (p,)."""
        changes, start = {}, 0
        for f in self.linear_fields():
            size = len(getattr(self, f.name))
            changes[f.name] = tuple(values[start:start + size].tolist())
            start += size
        return replace(self, **changes)

    @final
    def torque(self, flow: Flow) -> Tensor:
        """Return columns(flow) times the linear parameters, (n, joints) N m."""
        return self.columns(flow) @ self.linear_values()


def term_kinds() -> Mapping[str, type[LoadTerm]]:
    """Return every term declared in physics/loads by its kind."""
    import nnhydro.physics.loads as folder

    for module in pkgutil.iter_modules(folder.__path__):
        importlib.import_module(f"{folder.__name__}.{module.name}")

    def leaves(base: type[LoadTerm]) -> list[type[LoadTerm]]:
        return [leaf for sub in base.__subclasses__() for leaf in ([sub] if sub.kind else []) + leaves(sub)]

    base: Any = LoadTerm  # mypy takes an abstract class for an instance to be made here
    return {cls.kind: cls for cls in sorted(leaves(base), key=lambda cls: cls.kind)}


def term_of(document: Mapping[str, Any]) -> LoadTerm:
    """Return the term that `document` (from `LoadTerm.document`) describes; raise ModelError naming what does not fit."""
    kinds = term_kinds()
    kind = str(document.get("kind"))
    if kind not in kinds:
        raise ModelError(f"unknown load term {kind!r}: this version knows {', '.join(kinds)}; was the model written by a newer one?")
    try:
        return kinds[kind](**document.get("parameters", {}), **document.get("options", {}))
    except TypeError as cause:
        raise ModelError(f"term {kind!r}: {cause}") from cause
