"""One arm under control, one motion at a time: compiled, as the model that the controller holds, or simulated by code of its own.

The same law, the same Runge-Kutta steps and the same hold of the torque as in forward.py, for studies of hours, for truths that were
learned and for concealed worlds. What is compiled needs a C compiler.
"""

from dataclasses import dataclass
from typing import Any, Protocol, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.deployment.native import NativeArm
from nnhydro.dynamics.inertia import runge_kutta_step
from nnhydro.errors import ConfigError
from nnhydro.physics.motion import tensor
from nnhydro.simulation.forward import RUNAWAY
from nnhydro.simulation.motions.motion_kind import Reference, State
from nnhydro.simulation.run import Run, grid
from nnhydro.simulation.torque_law import TorqueLaw

Array = NDArray[np.float64]


class SteppedArm(Protocol):
    """What the loop asks of the arm that it moves; `dt` s have passed since the instant that was kept last."""

    def begin(self) -> None:
        """Forget the motion before: a run begins."""

    def torque(self, q: Any, qd: Any, qdd: Any, u0: float = 0.0, du0: float = 0.0, dt: float = 0.0) -> Array:
        """Return the joint torques (joints,) N m, and keep this instant."""

    def acceleration(self, q: Any, qd: Any, tau: Any, u0: float = 0.0, du0: float = 0.0, dt: float = 0.0, start: Any = None) -> Array:
        """Return the accelerations (joints,) rad/s^2 under `tau` N m; a search may begin at `start`."""

    def encoders(self, q: Array) -> Array:
        """Return the angles (joints,) rad that are read where the links stand at `q` (joints,) rad."""


@final
@dataclass(eq=False)
class NativeInside:
    """A compiled model in a controller."""

    arm: NativeArm

    def begin(self) -> None:
        """Forget the motion before: a run begins."""
        self.arm.begin()

    def torque(self, q: Tensor, qd: Tensor, qdd: Tensor, u0: Tensor, du0: Tensor, dt: float) -> Tensor:
        """Return the joint torques (1, joints) N m, `dt` s after the instant asked before."""
        return torch.from_numpy(self.arm.torque(q[0].numpy(), qd[0].numpy(), qdd[0].numpy(), float(u0[0]), float(du0[0]), dt))[None]


def stepped_once(truth: SteppedArm, q: Array, qd: Array, tau: Array, carriage: Array, h: float,
                 guess: Array | None = None) -> tuple[Array, Array, Array]:
    """Return q, qd after one Runge-Kutta step of `h` s and qdd at its start; `carriage` (3, 2) u0, du0 at its start, middle, end."""

    def acceleration(half: int, q: Array, qd: Array, near: Array | None) -> Array:
        return truth.acceleration(q, qd, tau, float(carriage[half, 0]), float(carriage[half, 1]), half * h / 2, near)

    return runge_kutta_step(acceleration, q, qd, h, guess)


def track(name: str, reference: Reference, truth: SteppedArm, law: TorqueLaw, rate_hz: float, hold: int) -> Run:
    """Return the run of `truth` along `reference` under `law`, which acts every `hold` steps of 1/`rate_hz` s.

    The controller sees what the truth's encoders read. Raises ConfigError where the arm runs away, ModelError where the truth has no
    acceleration for a torque.
    """
    t, h = grid(reference, rate_hz), 1.0 / rate_hz
    goal = reference.at(np.minimum(np.arange(2 * len(t)) * h / 2, reference.duration))
    q, qd, qdd = goal.q[0].copy(), goal.qd[0].copy(), goal.qdd[0].copy()
    carriage = np.stack([goal.u0, goal.du0], axis=1)
    truth.begin()
    truth.torque(q, qd, np.zeros_like(q), *carriage[0])
    seen, tau = law.begin(tensor(q)[None], tensor(qd)[None]), np.zeros_like(q)
    out = [np.empty((len(t), len(q))) for _ in range(4)]
    for k in range(len(t)):
        if k % hold == 0:
            wanted = (tensor(goal.q[2 * k])[None], tensor(goal.qd[2 * k])[None], tensor(goal.qdd[2 * k])[None])
            angles = tensor(truth.encoders(q))[None]
            tau = law.torque(seen, wanted, angles, tensor(qd)[None], *(tensor(x)[None] for x in carriage[2 * k]))[0].numpy()
        if not np.abs(qd).max() < RUNAWAY:
            raise ConfigError(f"motion {name!r}: the arm runs away at t = {k * h:.3g} s: lower the gains or raise the rate")
        ahead = carriage[[2 * k, 2 * k + 1, min(2 * k + 2, len(carriage) - 1)]]
        after = stepped_once(truth, q, qd, tau, ahead, h, qdd)
        for series, value in zip(out, (q, qd, after[2], tau), strict=True):
            series[k] = value
        q, qd, qdd = after
        truth.torque(q, qd, qdd, float(ahead[2, 0]), float(ahead[2, 1]), h)
    return Run(name, rate_hz, State(out[0], out[1], out[2], goal.u0[:2 * len(t):2], goal.du0[:2 * len(t):2]), out[3])
