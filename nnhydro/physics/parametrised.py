"""A thing with numbers to fit: dataclass fields made by `parameter`, each with unit, start, bounds and meaning, declared once.

Linear parameters enter the torque in proportion; the others shape its columns, and a search over them starts from their `grid`.
"""

import math
from collections.abc import Hashable, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from functools import cache
from typing import Any, ClassVar, Self, cast, final

import torch
from torch import Tensor

from nnhydro.errors import ModelError, require
from nnhydro.recordings.arm import Arm

Values = tuple[float, ...]
PER = ("link", "joint", "arm", "other joint")
ANY_SIZE, ANY_VALUE = (0.0, 1e12), (-1e12, 1e12)  # bounds of what has a unit of force or mass: machines are of any size


def parameter(unit: str, start: float, bounds: tuple[float, float], meaning: str, per: str = "link", linear: bool = True,
              grid: Sequence[float] = (), absent: bool = False, detail: Sequence[float] = ()) -> Any:
    """Return a dataclass field for a parameter: a tuple with one value per link, per joint, per joint but one, or one for the arm.

    `start` is where fits begin, `bounds` what physics allows, `linear` whether the torque is proportional to it; `grid` holds the values
    from which a search over a parameter that is not linear starts, `detail` those that are tried once the rest is found. One that may be
    `absent` has no values where none are given.
    """
    require(per in PER, f"parameter is per {per!r}: one of {PER}")
    card = {"unit": unit, "start": start, "bounds": bounds, "meaning": meaning, "per": per, "linear": linear, "grid": tuple(grid),
            "detail": tuple(detail)}
    return field(default=() if absent else MISSING, metadata=card)


@cache  # asked for with every torque
def _parameters(cls: Hashable) -> tuple["Field[Any]", ...]:
    declared = (declaration for declaration in fields(cast(Any, cls)) if "unit" in declaration.metadata)
    return tuple(sorted(declared, key=lambda declaration: declaration.kw_only is True))


@cache
def _linear(cls: Hashable) -> tuple["Field[Any]", ...]:
    return tuple(declaration for declaration in _parameters(cls) if declaration.metadata["linear"])


@dataclass(frozen=True)
class ParametricTerm:
    """Subclasses are frozen dataclasses; their fields made by `parameter` are tuples of floats, the others options."""

    kind: ClassVar[str] = ""  # name in model files

    def __post_init__(self) -> None:
        for declaration in self.parameters():
            values = getattr(self, declaration.name)
            try:
                object.__setattr__(self, declaration.name, tuple(float(v) for v in values))
            except (TypeError, ValueError) as cause:
                raise ModelError(f"term {self.kind!r}: {declaration.name} = {values!r} is not a list of numbers") from cause
        for option in self.options():
            value = getattr(self, option.name)
            if option.type in (float, "float"):
                finite = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
                require(finite, f"term {self.kind!r}: {option.name} = {value!r} is not a finite number", ModelError)

    @classmethod
    def parameters(cls) -> tuple["Field[Any]", ...]:
        """Return the dataclass fields that `parameter` made, those that a class shares with others (keywords) last."""
        return _parameters(cls)  # type: ignore[arg-type]

    @classmethod
    def options(cls) -> tuple["Field[Any]", ...]:
        """Return the other dataclass fields: choices, not numbers to fit."""
        return tuple(declaration for declaration in fields(cls) if "unit" not in declaration.metadata)

    @classmethod
    def at_start(cls, arm: Arm, **options: Any) -> Self:
        """Return the term with every parameter at its start value, sized for `arm`."""
        sizes = {"link": arm.n_links, "joint": arm.n_links, "arm": 1, "other joint": arm.n_links - 1}
        starts = {declaration.name: (declaration.metadata["start"],) * sizes[declaration.metadata["per"]]
                  for declaration in cls.parameters()}
        return cls(**starts, **options)

    def document(self) -> dict[str, Any]:
        """Return the term as model files store it."""
        return {"kind": self.kind,
                "parameters": {declaration.name: list(getattr(self, declaration.name)) for declaration in self.parameters()},
                "options": {declaration.name: getattr(self, declaration.name) for declaration in self.options()}}

    def linear_fields(self) -> tuple["Field[Any]", ...]:
        """Return the fields whose values enter linearly."""
        return _linear(type(self))  # type: ignore[arg-type]  # mypy: a type has an __eq__ of its own

    @final
    def linear_names(self) -> tuple[str, ...]:
        """Return one name a linear parameter, `C_D[1]` for the first link."""
        return tuple(f"{declaration.name}[{i + 1}]" if len(getattr(self, declaration.name)) > 1 or declaration.metadata["per"] != "arm"
                     else declaration.name
                     for declaration in self.linear_fields() for i in range(len(getattr(self, declaration.name))))

    @final
    def linear_values(self) -> Tensor:
        """Return the linear parameters as one vector (p,)."""
        return torch.tensor([v for declaration in self.linear_fields() for v in getattr(self, declaration.name)], dtype=torch.float64)

    @final
    def linear_bounds(self) -> tuple[tuple[float, float], ...]:
        """Return (lowest, highest) of each linear parameter."""
        return tuple(declaration.metadata["bounds"] for declaration in self.linear_fields() for _ in getattr(self, declaration.name))

    @final
    def linear_units(self) -> tuple[str, ...]:
        """Return the unit of each linear parameter."""
        return tuple(declaration.metadata["unit"] for declaration in self.linear_fields() for _ in getattr(self, declaration.name))

    @final
    def with_linear(self, values: Tensor) -> Self:
        """Return the term with its linear parameters replaced by `values` (p,)."""
        changes, start = {}, 0
        for declaration in self.linear_fields():
            size = len(getattr(self, declaration.name))
            changes[declaration.name] = tuple(values[start:start + size].tolist())
            start += size
        return replace(self, **changes)
