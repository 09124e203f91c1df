"""The state of an arm at an instant of a run, how its base and the water move, and the derivatives of its torques, in the caller's form."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, final

import numpy as np
import torch
from torch import Tensor

from nnhydro.dynamics.arrays import Answer, Form, Number, rows
from nnhydro.errors import ModelError, require
from nnhydro.physics.carried import Memory
from nnhydro.physics.motion import Base, Water

BASE: Final = ("base_x_m_s", "dbase_x_m_s2", "base_yaw_rad", "base_yaw_rad_s", "dbase_yaw_rad_s2")
CURRENT: Final = ("current_x_m_s", "current_y_m_s", "dcurrent_x_m_s2", "dcurrent_y_m_s2")
BaseMotion = Mapping[str, Number] | None  # by the keys of BASE and CURRENT, what is not given is 0; the base's velocity along +Y is u0


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


@final
@dataclass(frozen=True, eq=False)
class Surroundings:
    """How base and water move, row by row, at an instant; accelerations go on as they are."""

    base: Base
    current: Water | None

    def rows(self, chosen: Tensor) -> "Surroundings":
        """Return some rows."""
        return Surroundings(self.base.rows(chosen), None if self.current is None else self.current.rows(chosen))

    def after(self, h: float) -> "Surroundings":
        """Return both `h` s later."""
        base, current = self.base, self.current
        moved = Base(base.vx + h * base.ax, base.ax, base.heading + h * base.rate + h**2 / 2 * base.acceleration,
                     base.rate + h * base.acceleration, base.acceleration)
        return Surroundings(moved, None if current is None else Water(current.velocity + h * current.acceleration, current.acceleration))


def surroundings(given: BaseMotion, form: Form) -> Surroundings | None:
    """Return how base and water move, as rows; raises ModelError for a key that they do not have."""
    if given is None:
        return None
    known = (*BASE, *CURRENT)
    unknown = [key for key in given if key not in known]
    require(not unknown, f"base: unknown key {unknown[:1]}: give {', '.join(known)}; its velocity along +Y is u0", ModelError)
    _, (_, *values) = rows(0, {}, {"": torch.zeros(form.lead, dtype=torch.float64)} | {key: given.get(key, 0.0) for key in known})
    n = len(BASE)
    velocity, acceleration = torch.stack(values[n:n + 2], dim=1), torch.stack(values[n + 2:], dim=1)
    return Surroundings(Base(*values[:n]), Water(velocity, acceleration) if any(key in CURRENT for key in given) else None)


def step_length(dt: Any) -> float:
    """Return `dt` s as a number; raises ModelError where it is no positive one."""
    require(isinstance(dt, int | float | np.number) and bool(0 < dt < float("inf")), f"dt = {dt!r:.80}: give one positive step in s",
            ModelError)
    return float(dt)
