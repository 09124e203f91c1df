"""Numbers that a recipe gives once for all joints or once a joint."""

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field

from nnhydro.errors import require

Array = NDArray[np.float64]


def _as_tuple(value: Any) -> Any:
    return (value,) if isinstance(value, int | float | str) and not isinstance(value, bool) else value


Number = Annotated[float, Field(ge=-1e6, le=1e6)]
Magnitude = Annotated[float, Field(ge=0, le=1e6)]
PerJoint = Annotated[tuple[Number, ...], BeforeValidator(_as_tuple), Field(min_length=1, max_length=10)]
PerJointMagnitude = Annotated[tuple[Magnitude, ...], BeforeValidator(_as_tuple), Field(min_length=1, max_length=10)]


def spread(values: tuple[float, ...], joints: int, what: str) -> Array:
    """Return `values` as (joints,): one number serves all joints; raise ConfigError naming `what` where that fails."""
    require(len(values) in (1, joints), f"{what}: {len(values)} numbers for an arm of {joints} joint(s): give one, or one per joint")
    return np.broadcast_to(np.array(values, dtype=float), (joints,))


def one_each(values: tuple[float, ...], joints: int, what: str) -> Array:
    """Return `values` as (joints,); raise ConfigError naming `what` where the count is not one per joint."""
    require(len(values) == joints, f"{what}: {len(values)} numbers for an arm of {joints} joint(s): give one per joint")
    return np.array(values, dtype=float)
