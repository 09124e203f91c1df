"""What an instrument effect uses: the model's reading, how it changes in time, and how it changes with motion and water."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import cos, sin
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.memo import Memo
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.transmission import joint_torque, sensed_columns, sensor_torque
from nnhydro.recordings.arm import Arm

TorqueOf = Callable[[Flow], Tensor]
TorquesOf = Callable[[Sequence[Flow]], list[Tensor]]
WATER_STEP = 1e-6  # m/s, m/s^2: the slopes of what the water loads are continuous, so that one side tells them
STEP = 1e-4  # rad, rad/s, rad/s^2, m/s, m/s^2: of differences that are exact to second order


def time_derivative(t: Tensor, x: Tensor) -> Tensor:
    """Return dx/dt (n, k) of `x` (n, k) at evenly spaced times `t` (n,), by a cubic spline: 0.4 % low at a seventh of the sampling rate.

        s_(i-1) + 4 s_i + s_(i+1) = 3 (x_(i+1) - x_(i-1)) / h,   not-a-knot ends        s = dx/dt
    """
    from scipy.linalg.lapack import dgtsv

    n = len(t)
    if n < 4:
        return torch.zeros_like(x)
    d = torch.diff(x, dim=0) / ((t[-1] - t[0]) / (n - 1))
    right = torch.cat([(5 * d[:1] + d[1:2]) / 2, 3 * (d[1:] + d[:-1]), (5 * d[-1:] + d[-2:-1]) / 2])
    return tensor(dgtsv(*_spline_diagonals(n), right.numpy())[3])  # without the checks of `solve_banded`, which take ten times as long


@lru_cache(maxsize=32)
def _spline_diagonals(n: int) -> tuple[NDArray[np.float64], ...]:
    """The lower (n - 1,), main (n,) and upper (n - 1,) diagonals of a cubic spline's slopes on an even grid with not-a-knot ends."""
    lower, main, upper = np.ones(n - 1), np.full(n, 4.0), np.ones(n - 1)
    main[[0, -1]] = 1.0
    upper[0] = lower[-1] = 2.0
    return lower, main, upper


def unit_vector(angle: float) -> Tensor:
    """Return the unit vector (2,) at `angle` rad from +X."""
    return torch.tensor([cos(angle), sin(angle)], dtype=torch.float64)


@final
@dataclass(frozen=True, eq=False)
class SensorView:
    """One gap-free stretch of a recording as the model sees it: `torques_of(flows)` (n, joints) N m is what ideal sensors would read.

    `place` (n,) is the time within the campaign, -1 at its first row and 1 at its last, and `measured` (n, joints) N m what was read while
    it was recorded, not filtered; None: not known.
    """

    flow: Flow
    torques_of: TorquesOf
    place: Tensor | None = None
    measured: Tensor | None = None
    hub_force_of: TorqueOf | None = None  # the force (n, 2) N along X and Y that the hub supplies; None: not known

    @staticmethod
    def of(loads: Loads, flow: Flow, place: Tensor | None = None, measured: Tensor | None = None) -> "SensorView":
        """Return what the sensors see where the sum `loads` is the truth."""
        def torques_of(flows: Sequence[Flow]) -> list[Tensor]:
            """Return what the sensors read at each of `flows`, (n, joints) N m."""
            return [sensor_torque(tau, one.motion.qd, one.arm) for tau, one in zip(loads.torques(flows), flows, strict=True)]

        return SensorView(flow, torques_of, place, measured, loads.hub_force)

    def torque_of(self, flow: Flow) -> Tensor:
        """Return what ideal sensors would read at `flow`, (n, joints) N m."""
        return self.torques_of([flow])[0]

    @cached_property
    def memo(self) -> Memo:
        """What hypotheses about this reading share."""
        return Memo()

    @property
    def motion(self) -> Motion:
        """Motion as it was read."""
        return self.flow.motion

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.flow.arm

    @cached_property
    def tau(self) -> Tensor:  # (n, joints) N m
        """The model's reading."""
        return self.torque_of(self.flow)

    @cached_property
    def rate(self) -> Tensor:  # (n, joints) N m/s
        """d tau / dt; 0 in steady rows."""
        return self.in_time(self.tau)

    def joint_torque(self, reading: Tensor) -> Tensor:
        """Return the torques at the joints (n, joints) N m behind a reading: before belt and gear."""
        return joint_torque(reading, self.motion.qd, self.arm)

    def as_read(self, columns: Tensor) -> Tensor:
        """Return columns (n, joints, p) of joint torque as the sensors read them, behind belt and gear."""
        return sensed_columns(columns, self.joint_torque(self.tau), self.motion.qd, self.arm)

    def in_time(self, x: Tensor) -> Tensor:
        """Return dx/dt (n, k) of `x` (n, k) along this stretch; 0 in steady rows."""
        return torch.zeros_like(x) if self.motion.steady else time_derivative(self.motion.t, x)

    def flow_moved_by(self, dq: Tensor, dqd: Tensor | None = None, dqdd: Tensor | None = None) -> Flow:
        """Return the flow of the arm with its angles, rates and accelerations (n, joints) changed by these."""
        m = self.motion
        qd = m.qd if dqd is None else m.qd + dqd
        qdd = m.qdd if dqdd is None else m.qdd + dqdd
        return replace(self.flow, motion=replace(m, q=m.q + dq, qd=qd, qdd=qdd))

    def slopes(self, flows_at: Sequence[Callable[[float], Flow]]) -> list[Tensor]:
        """Return the central difference (n, joints) of the reading by what each of `flows_at` moves the flow by."""
        ahead, behind = ([flow_at(step) for flow_at in flows_at] for step in (STEP, -STEP))
        torques = self.torques_of([*ahead, *behind])
        return [(more - less) / (2 * STEP) for more, less in zip(torques[:len(ahead)], torques[len(ahead):], strict=True)]

    def by_motion(self, channel: int, joint: int) -> Tensor:  # (n, joints) N m/rad, N m s/rad, N m s^2/rad
        """Return d tau / d angle (0), rate (1) or acceleration (2) of `joint` (from 1). A memory of the model moves along with the run."""
        def slopes() -> list[Tensor]:
            """Return the central differences over the channels of the joint, (n, joints) each."""
            unit = torch.zeros_like(self.motion.q)
            unit[:, joint - 1] = 1.0
            none = torch.zeros_like(unit)
            return self.slopes([lambda step: self.flow_moved_by(step * unit), lambda step: self.flow_moved_by(none, step * unit),
                                lambda step: self.flow_moved_by(none, none, step * unit)])

        return self.memo.of(("by_motion", joint), slopes)[channel]

    def along(self, dq: Tensor, joint: int) -> Tensor:
        """Return the first-order change (n, joints) N m when the angle of `joint` (from 1) changes by dq(t) (n,), its rates with it."""
        dqd = self.in_time(dq[:, None])
        by_angle, by_rate, by_acceleration = (self.by_motion(channel, joint) for channel in range(3))
        return by_angle * dq[:, None] + by_rate * dqd + by_acceleration * self.in_time(dqd)

    @cached_property
    def by_water(self) -> tuple[Tensor, Tensor]:  # two of (n, joints, links, 2) N m s/m, N m s^2/m
        """d tau / d velocity and d tau / d acceleration of the water at each link, along X and Y."""
        links = self.arm.n_links
        zero = torch.zeros(len(self.motion), links, 2, dtype=torch.float64)
        units = torch.eye(2 * links, dtype=torch.float64).reshape(2 * links, links, 2)
        moved = [*(self.flow.in_water(WATER_STEP * u + zero, zero) for u in units),
                 *(self.flow.in_water(zero, WATER_STEP * u + zero) for u in units)]
        slopes = torch.stack([(torque - self.tau) / WATER_STEP for torque in self.torques_of(moved)], dim=-1)
        velocity, acceleration = slopes.reshape(*self.motion.q.shape, 2, links, 2).unbind(2)
        return velocity, acceleration
