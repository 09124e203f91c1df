"""The keys of a recipe file and what they default to; motions and terms are checked by their own kinds."""

from math import ceil
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from nnhydro.conventions import SCHEMA_RECIPE
from nnhydro.errors import ConfigError, require
from nnhydro.recordings.readers.validation import Settings
from nnhydro.simulation.controller import Controller
from nnhydro.simulation.motions.motion_kind import State
from nnhydro.simulation.recipe.concealed_truth import TruthKeys
from nnhydro.simulation.recipe.per_joint import PerJointMagnitude, spread
from nnhydro.simulation.sensors import Sensors

Array = NDArray[np.float64]
FINE_HZ = 1000.0  # the fine grid is at least as fine unless `substeps` says otherwise


class MotionLimits(Settings):
    """What the rig allows; a motion that leaves it is refused. `q_rad`: [lowest, highest] a joint."""

    q_rad: tuple[tuple[float, float], ...] | None = None
    dq_rad_s: PerJointMagnitude | None = None
    u0_m_s: float | None = Field(default=None, ge=0, le=100)

    def require_within(self, state: State, t: Array, motion: str) -> None:
        """Raise ConfigError naming `motion`, joint, time and value where `state` leaves the limits."""
        joints = state.q.shape[1]
        angle, rate = np.full((joints, 2), [-np.inf, np.inf]), np.full(joints, np.inf)
        if self.q_rad is not None:
            require(len(self.q_rad) == joints,
                    f"limits.q_rad: {len(self.q_rad)} pair(s) for an arm of {joints} joint(s): give one per joint")
            angle = np.array(self.q_rad)
        if self.dq_rad_s is not None:
            rate = spread(self.dq_rad_s, joints, "limits.dq_rad_s")
        speed = np.inf if self.u0_m_s is None else self.u0_m_s
        for column, x, low, high in (("q{}_rad", state.q, angle[:, 0], angle[:, 1]), ("dq{}_rad_s", state.qd, -rate, rate),
                                     ("u0_m_s", state.u0[:, None], np.array([-speed]), np.array([speed]))):
            bad = np.argwhere((x < low - 1e-9) | (x > high + 1e-9))
            if len(bad):
                row, joint = int(bad[0][0]), int(bad[0][1])
                raise ConfigError(f"motion {motion!r}: {column.format(joint + 1)} = {x[row, joint]:.4g} at t = {t[row]:.4g} s is outside "
                                  f"the limits {low[joint]:.4g} to {high[joint]:.4g}: slow it down, shorten its way or widen limits")


class RecipeFile(Settings):
    """The keys of a recipe; motions and terms are checked one by one by their own kind."""

    schema_: Literal["nnhydro/recipe/1"] = Field(default=SCHEMA_RECIPE, alias="schema")
    name: str = Field(default="campaign", max_length=200)
    arm: dict[str, Any] | str | None = None
    terms: dict[str, Any] = Field(default={})
    truth: Annotated[str, Field(max_length=1000)] | TruthKeys | None = None
    motions: tuple[Any, ...] = Field(min_length=1, max_length=1000)
    controller: Controller | None = None
    sensors: Sensors = Sensors()
    limits: MotionLimits = MotionLimits()
    seed: int = Field(default=0, ge=0, lt=2**63)
    sample_rate_hz: float = Field(default=100.0, ge=1, le=1e4)
    substeps: int | None = Field(default=None, ge=1, le=1000)
    unseen: tuple[str, ...] = Field(default=(), max_length=1000)

    @field_validator("controller", mode="before")
    @classmethod
    def _none(cls, value: Any) -> Any:
        if isinstance(value, str) and value != "none":
            raise ValueError("must be 'none' or a mapping with kind, kp and kd")
        return None if isinstance(value, str) else value

    @model_validator(mode="after")
    def _one_truth(self) -> Self:
        """The truth is a sum of terms on an arm, or a model or a concealed world, which bring their own arm."""
        if self.truth is None and self.arm is None:
            raise ValueError("key 'arm' is missing: give arm and terms, or truth (the folder of a model, or concealed: ...)")
        if self.truth is not None and (self.terms or self.arm is not None):
            raise ValueError("truth brings an arm of its own: leave out arm and terms")
        return self

    @model_validator(mode="after")
    def _controller_instants_on_the_grid(self) -> Self:
        """The rate of the controller divides that of the simulation."""
        if self.controller is not None and self.controller.rate_hz is not None:
            steps = self.fine_rate_hz / self.controller.rate_hz
            if round(steps) < 1 or abs(steps - round(steps)) > 1e-6 * steps:
                raise ValueError(f"controller.rate_hz must divide the simulation's {self.fine_rate_hz:g} Hz (sample_rate_hz x substeps)")
        return self

    @property
    def steps(self) -> int:
        """Steps of the simulation in one sample."""
        return self.substeps or ceil(FINE_HZ / self.sample_rate_hz)

    @property
    def fine_rate_hz(self) -> float:
        """Steps of the simulation in one second."""
        return self.sample_rate_hz * self.steps

    @property
    def hold(self) -> int:
        """Steps of the simulation in one period of the controller."""
        rate = self.controller.rate_hz if self.controller and self.controller.rate_hz else self.sample_rate_hz
        return round(self.fine_rate_hz / rate)
