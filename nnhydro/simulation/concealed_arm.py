"""The arm of a concealed world under control: its own equation of motion, by the blind tests' own code, solved for the acceleration.

    tau_joint(t, q, qd, qdd, u0, du0) = tau          at once where it is affine in qdd, else by Newton's method          [N m]

What is hidden must depend on the state of the moment alone, on the time and on the carriage's way: `steps` finds out by trying.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.blind_tests.truth.campaign import World
from nnhydro.blind_tests.truth.tank import joint_torque
from nnhydro.blind_tests.truth.world import TrueRun
from nnhydro.dynamics.inertia import acceleration, mass_and_bias
from nnhydro.physics.motion import tensor

Array = NDArray[np.float64]
SAME = 1e-9  # relative: torques that should agree differ by rounding only
TRIAL_DT, TRIAL_ROWS, TRIAL_AFTER = 0.02, 61, 25  # s; instants up to the one compared, and after it
WIDE = 1e3  # rad/s^2: enough to turn the load of every joint round
CHANCES = 8  # draws of what acts by chance: a blow falls in six runs of ten


@final
class ConcealedArm:
    """What the control loop asks of an arm: torque, acceleration, what the encoders read. It keeps the time and the carriage's way."""

    def __init__(self, world: World, run: TrueRun, affine: bool) -> None:
        """Take name, time of day and chance from `run`; `affine`: the torque is, in the acceleration."""
        self.world, self.run, self.affine = world, run, affine
        self.begin()

    def begin(self) -> None:
        """Go back to the beginning of the run."""
        self.t, self.way, self.u0 = 0.0, 0.0, 0.0

    def _ahead(self, u0: float, dt: float) -> tuple[float, float]:
        """Time in s and way of the carriage in m, `dt` s after the instant that was asked last."""
        return self.t + dt, self.way + dt * (self.u0 + u0) / 2

    def _torques(self, q: Array, qd: Array, qdd: Array, u0: float, du0: float, dt: float) -> Array:
        """Joint torques (k, joints) N m at k accelerations (k, joints), all at one instant."""
        even, (t, way) = np.ones(len(qdd)), self._ahead(u0, dt)
        run = replace(self.run, t=t * even, q=even[:, None] * q, qd=even[:, None] * qd, qdd=qdd, u0=u0 * even, du0=du0 * even, way=way)
        return joint_torque(run, self.world.arm, self.world.causes)

    def torque(self, q: Array, qd: Array, qdd: Array, u0: float = 0.0, du0: float = 0.0, dt: float = 0.0) -> Array:
        """Return the joint torques (joints,) N m `dt` s after the instant that was asked last."""
        found: Array = self._torques(q, qd, qdd[None], u0, du0, dt)[0]
        (self.t, self.way), self.u0 = self._ahead(u0, dt), u0
        return found

    def acceleration(self, q: Array, qd: Array, tau: Array, u0: float = 0.0, du0: float = 0.0, dt: float = 0.0,
                     start: Array | None = None) -> Array:
        """Return the accelerations (joints,) rad/s^2 under `tau` (joints,) N m, `dt` s after the instant that was asked last.

        Raises ModelError where no acceleration gives this torque.
        """
        def torque(qdd: Tensor) -> Tensor:
            """Return the torques (1, k, joints) N m at accelerations (1, k, joints) rad/s^2."""
            return torch.from_numpy(self._torques(q, qd, qdd[0].numpy(), u0, du0, dt))[None]

        if self.affine:
            mass, bias = mass_and_bias(torque, tensor(q)[None])
            return np.asarray(np.linalg.solve(mass[0].numpy(), tau - bias[0].numpy()))
        near = np.zeros_like(q) if start is None else start
        return np.asarray(acceleration(torque, tensor(tau)[None], tensor(near)[None])[0].numpy())

    def encoders(self, q: Array) -> Array:
        """Return the angles (joints,) rad that the encoders read where the links stand at `q` (joints,) rad."""
        still = np.zeros((1, len(q)))
        run = replace(self.run, t=np.zeros(1), q=q[None], qd=still, qdd=still, u0=still[:, 0], du0=still[:, 0])
        return q + sum((cause.angle(run, still)[0] for cause in self.world.causes if cause.angle is not None), np.zeros_like(q))


def _differ(a: Array, b: Array) -> bool:
    return bool(np.abs(a - b).max() > SAME * (1.0 + np.abs(a).max()))


def _trial(joints: int, past: float, rest: bool, after: int, chance: int) -> TrueRun:
    """A run that is in one and the same state at row TRIAL_ROWS - 1, whatever `past` was and however many rows come `after`."""
    t = TRIAL_DT * np.arange(1 - TRIAL_ROWS, after + 1)
    j, moving = np.arange(1.0, joints + 1), 0.0 if rest else 1.0
    speed = np.asarray(0.4 + 0.2 * t, np.float64)
    before: Array = np.minimum(t, 0.0)[:, None] * np.ones(joints)  # (rows, joints) s
    q = 0.6 * j + moving * (0.5 * j * t[:, None] - t[:, None]**2 / 2) + past * before**3
    qd = moving * (0.5 * j - t[:, None]) + 3 * past * before**2
    qdd = -moving + 6 * past * before
    return TrueRun("trial", t - t[0], q, qd, qdd, speed, np.full(len(t), 0.2), seed=chance)


def _trials(world: World, after: int = 0) -> Iterator[tuple[TrueRun, ...]]:
    """Runs whose last instants (before the `after` rows of some) are alike; only what remembers tells them apart."""
    chances = CHANCES if any(cause.chance for cause in world.causes) else 1
    for chance in range(chances):
        for rest in (False, True):
            yield tuple(_trial(len(world.arm.links), past, rest, more, chance)
                        for past, more in ((0.0, 0), (2.0, 0), (-2.0, 0), (0.0, after)))


def steps(world: World) -> bool:
    """Return whether the joint torques of `world` depend on the state of the moment, the time and the carriage's way alone."""
    for runs in _trials(world, TRIAL_AFTER):
        first, *others = (joint_torque(run, world.arm, world.causes)[TRIAL_ROWS - 1] for run in runs)
        if any(_differ(first, other) for other in others):
            return False
    return True


def is_affine(world: World) -> bool:
    """Return whether the joint torques of `world`, which `steps`, are affine in the acceleration."""
    for runs in _trials(world):
        run = runs[0]
        arm = ConcealedArm(world, run, affine=True)
        n, last = len(world.arm.links), -1
        qdd = np.array([[-WIDE], [0.0], [WIDE]]) * np.ones(n)
        low, middle, high = arm._torques(run.q[last], run.qd[last], qdd, run.u0[last], run.du0[last], 0.0)
        if _differ(middle, (low + high) / 2):
            return False
    return True
