"""The torque of a controller, instant by instant, for many arms side by side."""

from collections import deque
from dataclasses import dataclass
from typing import Protocol, final

import torch
from torch import Tensor

from nnhydro.dynamics.joint_model import JointModel
from nnhydro.physics.carried import Memory, StepMemory
from nnhydro.physics.motion import Motion


class InverseDynamics(Protocol):
    """What a controller asks of the model that it holds."""

    def begin(self) -> None:
        """Forget the motion before: a run begins."""

    def torque(self, q: Tensor, qd: Tensor, qdd: Tensor, u0: Tensor, du0: Tensor, dt: float) -> Tensor:
        """Return the joint torques (m, joints) N m, `dt` s after the instant asked before."""


@final
@dataclass(eq=False)
class Inside:
    """A model that follows the motion which a controller sees."""

    model: JointModel
    memory: Memory | None = None

    def begin(self) -> None:
        """Forget the motion before: a run begins."""
        self.memory = None

    def torque(self, q: Tensor, qd: Tensor, qdd: Tensor, u0: Tensor, du0: Tensor, dt: float) -> Tensor:
        """Return the joint torques (m, joints) N m, `dt` s after the instant asked before."""
        none = torch.zeros(len(q), dtype=torch.float64)
        carried = StepMemory(none + dt, self.memory)
        with torch.no_grad():
            tau = self.model.torque(Motion(none, q, qd, qdd, u0, du0, steady=True, carried=carried))
        self.memory = carried.after
        return tau


@final
@dataclass(eq=False)
class LawMemory:
    """What a controller keeps from instant to instant within a run."""

    integral: Tensor  # (m, joints) rad s
    waiting: deque[Tensor]  # torques decided and not yet acting
    q: Tensor | None = None  # (m, joints) rad, as the encoders read
    qd: Tensor | None = None
    instants: int = 0


@final
@dataclass(frozen=True, eq=False)
class TorqueLaw:
    """The torque of a controller (controller.py), for a batch of m arms; gains are (joints,)."""

    kind: str
    kp: Tensor
    kd: Tensor
    ki: Tensor
    slope: Tensor
    boundary: Tensor
    limit: Tensor  # N m
    inside: InverseDynamics | None
    period: float  # s
    late: int = 0  # periods between a decision and its effect
    step: float | None = None  # rad of an encoder
    smoothing: float = 1.0  # of the rate from encoder steps: share of the newest difference

    def begin(self, q: Tensor, qd: Tensor) -> LawMemory:
        """Return what is kept at the beginning of a run from `q`, `qd` (m, joints)."""
        if self.inside is not None:
            self.inside.begin()
        none = torch.zeros_like(q)
        return LawMemory(none, deque([none.clone() for _ in range(self.late)]), None, qd.clone())

    def _see(self, seen: LawMemory, q: Tensor, qd: Tensor) -> tuple[Tensor, Tensor]:
        """Angles and rates as the controller sees them."""
        if self.step is None:
            return q, qd
        read = torch.round(q / self.step) * self.step
        assert seen.qd is not None
        if seen.q is not None:
            seen.qd = seen.qd + self.smoothing * ((read - seen.q) / self.period - seen.qd)
        seen.q = read
        return read, seen.qd

    def torque(self, seen: LawMemory, reference: tuple[Tensor, Tensor, Tensor], q: Tensor, qd: Tensor, u0: Tensor, du0: Tensor) -> Tensor:
        """Return tau (m, joints) N m that acts now; `reference` q, qd, qdd, actual q, qd (m, joints), carriage u0, du0 (m,)."""
        q, qd = self._see(seen, q, qd)
        e, de, dt = reference[0] - q, reference[1] - qd, self.period if seen.instants else 0.0
        seen.instants += 1
        if self.kind == "sliding_mode":
            assert self.inside is not None
            s = de + self.slope * e
            push = self.kp * torch.clamp(s / self.boundary, -1.0, 1.0)
            tau = self.inside.torque(q, qd, reference[2] + self.slope * de, u0, du0, dt) + push
        elif self.kind == "computed_torque":
            assert self.inside is not None
            tau = self.inside.torque(q, qd, reference[2] + self.kp * e + self.kd * de, u0, du0, dt)
        else:
            tau = self.kp * e + self.kd * de + (self.ki * seen.integral if self.kind == "pid" else 0.0)
        clipped = torch.clamp(tau, -self.limit, self.limit)
        seen.integral = torch.where(clipped == tau, seen.integral + self.period * e, seen.integral)
        seen.waiting.append(clipped)
        return seen.waiting.popleft()
