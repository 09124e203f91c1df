"""The state of an arm at an instant of a run, how its base moves, and the derivatives of its torques, in the caller's form."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, final

import numpy as np
import torch

from nnhydro.dynamics.arrays import Answer, Form, Number, rows
from nnhydro.errors import ModelError, require
from nnhydro.physics.carried import Memory
from nnhydro.physics.motion import Base

BASE: Final = ("base_x_m_s", "dbase_x_m_s2", "base_yaw_rad", "base_yaw_rad_s", "dbase_yaw_rad_s2")
BaseMotion = Mapping[str, Number] | None  # by the keys of BASE, what is not given is 0; the base's velocity along +Y is u0


@final
@dataclass(frozen=True, eq=False)
class ArmState:
    """An arm, or many, at an instant of a run: angles, rates, carriage speed, and what the water and the contacts remember."""

    q: Answer  # (..., joints) rad
    qd: Answer  # (..., joints) rad/s
    u0: Answer  # (...,) m/s
    t: float  # s since `reset`
    memory: Memory  # rows first; empty where the model remembers nothing


@final
@dataclass(frozen=True, eq=False)
class Jacobians:
    """Derivatives of the joint torques; the last axis of q, qd and qdd is the joint that moves."""

    q: Answer  # (..., joints, joints) N m/rad
    qd: Answer  # (..., joints, joints) N m s/rad
    qdd: Answer  # (..., joints, joints) kg m^2
    u0: Answer  # (..., joints) N s
    du0: Answer  # (..., joints) kg m


def base_rows(given: BaseMotion, form: Form) -> Base | None:
    """Return the base's motion as rows; raises ModelError for a key that it does not have."""
    if given is None:
        return None
    unknown = [key for key in given if key not in BASE]
    require(not unknown, f"base: unknown key {unknown[:1]}: give {', '.join(BASE)}; its velocity along +Y is u0", ModelError)
    _, values = rows(0, {}, {"": torch.zeros(form.lead, dtype=torch.float64)} | {key: given.get(key, 0.0) for key in BASE})
    return Base(*values[1:])


def step_length(dt: Any) -> float:
    """Return `dt` s as a number; raises ModelError where it is no positive one."""
    require(isinstance(dt, int | float | np.number) and bool(0 < dt < float("inf")), f"dt = {dt!r:.80}: give one positive step in s",
            ModelError)
    return float(dt)
