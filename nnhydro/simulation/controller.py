"""Joint controllers: they see angles and rates at their own rate and hold the torque in between.

    pd               tau = kp (q_ref - q) + kd (qd_ref - qd)                                   kp [N m/rad], kd [N m s/rad]
    computed_torque  tau = M(q) (qdd_ref + kp (q_ref - q) + kd (qd_ref - qd)) + h(q, qd)       kp [1/s^2],   kd [1/s]

    M, h   of the dry arm as arm.yaml states it: the controller knows the arm, not the water

The torques are those at the joints, whatever drives them; `torque_limit_Nm` clips each.
"""

from dataclasses import dataclass
from typing import Literal, final

import numpy as np
import torch
from pydantic import Field
from torch import Tensor

from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import tensor
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.validation import Settings
from nnhydro.simulation.per_joint import PerJointMagnitude, spread
from nnhydro.simulation.plant import Plant


@final
@dataclass(frozen=True, eq=False)
class TorqueLaw:
    """The torque of a controller, for a batch of m states."""

    kp: Tensor  # (joints,)
    kd: Tensor  # (joints,)
    limit: Tensor  # (joints,) N m
    knows: Plant | None  # the model in a computed torque

    def torque(self, error: Tensor, rate_error: Tensor, qdd_ref: Tensor, *state: Tensor) -> Tensor:
        """Return tau (m, joints) N m; `error`, `rate_error` reference minus actual, `state` t, q, qd, u0, du0 as `Plant` takes them."""
        push = self.kp * error + self.kd * rate_error
        if self.knows is not None:
            mass, rest = self.knows.mass_and_rest(*state)
            push = torch.einsum("mjk,mk->mj", mass, qdd_ref + push) + rest
        return torch.clamp(push, -self.limit, self.limit)


class Controller(Settings):
    """Gains (one, or one a joint), the largest torque, and how often the controller acts (default: once a sample)."""

    kind: Literal["pd", "computed_torque"]
    kp: PerJointMagnitude
    kd: PerJointMagnitude
    torque_limit_Nm: PerJointMagnitude | None = None
    rate_hz: float | None = Field(default=None, gt=0, le=1e5)

    def torque_law(self, arm: Arm) -> TorqueLaw:
        """Return the law for `arm`; raise ConfigError where a gain does not fit its joints."""
        n = arm.n_links
        limit = np.full(n, np.inf) if self.torque_limit_Nm is None else spread(self.torque_limit_Nm, n, "controller.torque_limit_Nm")
        knows = Plant(arm, Loads({"rigid_body": RigidBody.of_arm(arm)})) if self.kind == "computed_torque" else None
        return TorqueLaw(tensor(spread(self.kp, n, "controller.kp")), tensor(spread(self.kd, n, "controller.kd")), tensor(limit), knows)
