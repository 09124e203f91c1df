"""Steady runs on a grid: every tow speed with every angle and rate, one row per run, torque averaged over the run.

Source: Rivera (1995), section 4.2 (one run for each angle of joint 1, angle of joint 2 and speed, in steps of 15 degrees).
"""

from itertools import product
from typing import Literal, final

import numpy as np
from pydantic import Field

from nnhydro.errors import require
from nnhydro.simulation.motions.motion_kind import MotionKind, State
from nnhydro.simulation.recipe.per_joint import Number, PerJoint

MAX_RUNS = 100_000


@final
class SteadyRuns(MotionKind):
    """All combinations of the carriage speeds `u0_m_s`, the angles `q_rad` and the rates `dq_rad_s` (one list per joint; default 0).

    Each run lasts `duration_s`: the longer, the smaller the error of the mean torque. The table becomes steady/NAME.csv.
    """

    kind: Literal["steady"] = "steady"
    u0_m_s: tuple[Number, ...] = Field(min_length=1, max_length=1000)
    q_rad: tuple[PerJoint, ...] = Field(min_length=1, max_length=10)
    dq_rad_s: tuple[PerJoint, ...] | None = None
    duration_s: float = Field(default=5.0, gt=0, le=3600)

    def states(self, joints: int) -> State:
        """Return the grid, one row per run, the last joint's rate varying fastest; raise ConfigError naming motion and key."""
        rates = self.dq_rad_s if self.dq_rad_s is not None else ((0.0,),) * joints
        for key, axes in (("q_rad", self.q_rad), ("dq_rad_s", rates)):
            require(len(axes) == joints, f"motion {self.name!r}: {key}: {len(axes)} list(s) for an arm of {joints} joint(s): give one a "
                    "joint")
        axes = (self.u0_m_s, *self.q_rad, *rates)
        runs = int(np.prod([float(len(axis)) for axis in axes]))
        require(runs <= MAX_RUNS, f"motion {self.name!r}: the grid has {runs} runs, more than {MAX_RUNS}: use fewer values")
        rows = np.array(list(product(*axes)), dtype=float)
        zeros = np.zeros((len(rows), joints))
        return State(rows[:, 1:1 + joints], rows[:, 1 + joints:], zeros, rows[:, 0], np.zeros(len(rows)))
