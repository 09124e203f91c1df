"""A compliant drive: the sensor reads the angle of the drive, and a twist that depends on the torque turns the link.

    q_link = q_drive + twist,   tau = tau(q_link, dq_link/dt, d2q_link/dt2)

A gap's twist is a law of the torque: fixed-point iteration; where it does not converge, the last round that came closer is kept. A spring's
twist rings with the link's inertia: an equation of motion about the motion of the drive.
"""

from collections.abc import Callable
from math import inf, isfinite

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.effects.sensor_view import SensorView
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import tensor

Array = NDArray[np.float64]
Twist = tuple[Tensor, Tensor, Tensor]  # angle, rate and acceleration (n,): rad, rad/s, rad/s^2
STEP, MOST_STEPS = 0.4, 8  # radians of the resonance a step: its period 1 % long; steps a row: beyond, nothing that is sampled rings
LIGHTEST = 1e-9  # kg m^2
BUCKLED = 0.1  # of the spring: what is left of it where a weight above the joint pulls the other way
ROUNDS = 8
HARDENING_ROUNDS = 6  # at a twist of 1.5 times that of double stiffness, the reading is then within 5 %
DONE = 1e-6  # of the largest torque: far below any sensor


def direction(seen: SensorView, twist: Tensor, joint: int) -> Tensor:
    """Return `twist` (n,) rad as a change of all angles (n, joints)."""
    dq = torch.zeros_like(seen.motion.q)
    dq[:, joint - 1] = twist
    return dq


def twisted_flow(seen: SensorView, joint: int, twist: Tensor) -> Flow:
    """Return the flow of an arm whose `joint` (from 1) is twisted by `twist` (n,) rad."""
    dq = direction(seen, twist, joint)
    dqd = seen.in_time(dq)
    return seen.flow_moved_by(dq, dqd, seen.in_time(dqd))


def turned_reading(seen: SensorView, joint: int, twist: Callable[[Tensor], Tensor]) -> Tensor:
    """Return the reading (n, joints) N m of an arm whose `joint` (from 1) twists by `twist(tau_j)` (n,) rad, tau_j at the joint."""
    return _fixed_point(seen, joint, twist, lambda turn: seen.torque_of(twisted_flow(seen, joint, turn)))


def _fixed_point(seen: SensorView, joint: int, twist: Callable[[Tensor], Tensor], torque_at: Callable[[Tensor], Tensor]) -> Tensor:
    """The reading at which the twist is that of its own torque; `torque_at(turn)` is the torque with the joint turned by that angle."""
    tau, size = seen.tau, float("inf")
    for _ in range(ROUNDS):
        after = torque_at(twist(seen.joint_torque(tau)[:, joint - 1]))
        change = float((after - tau).abs().max()) if len(tau) else 0.0
        if change > size:
            return tau
        tau, size = after, change
        if size <= DONE * float(seen.tau.abs().max() if len(tau) else 0.0):
            break
    return tau


def by_joint_motion(seen: SensorView, joint: int, channel: int) -> Tensor:
    """Return d tau_j / d angle (0), rate (1) or acceleration (2) of `joint` (from 1) itself, (n,): before belt and gear."""
    def difference() -> Tensor:
        """Return the difference at the joint itself."""
        change = seen.joint_torque(seen.tau + seen.by_motion(channel, joint)) - seen.joint_torque(seen.tau)
        return change[:, joint - 1]

    return seen.memo.of(("by_joint_motion", joint, channel), difference)


def ringing_twist(seen: SensorView, joint: int, stiffness: float, damping: float, doubled: float = inf) -> Twist:
    """Return the twist delta of a spring that carries the link at `joint` (from 1), its rate and acceleration, each (n,).

        J delta'' + (D + c) delta' + (S + k + k (delta/delta_2)^2) delta = -tau_j      J, D, S = d tau_j / d (acceleration, rate, angle)

    `stiffness` k in N m/rad, `damping` c in N m s/rad, `doubled` delta_2 in rad. By the trapezoidal rule, in steps short against the
    resonance, from rest under the first torque. Where the resonance lies beyond the samples nothing rings. The cubic spring is found in
    HARDENING_ROUNDS, each with the stiffness at the twist before. Source: linearisation of Spong (1987), with a damped spring.
    """
    twist = seen.memo.of(("linear twist", joint, stiffness, damping),
                         lambda: _linear_twist(seen, joint, torch.full_like(seen.motion.t, stiffness), damping))
    square = twist[0] ** 2
    for _ in range(HARDENING_ROUNDS if isfinite(doubled) else 0):
        before = twist[0].abs()
        twist = _linear_twist(seen, joint, stiffness * (1 + square / doubled**2), damping)
        square = before * twist[0].abs()  # between both: from one round to the next the twist would jump to and fro
    return twist


def _linear_twist(seen: SensorView, joint: int, stiffness: Tensor, damping: float) -> Twist:
    """The twist of a spring whose `stiffness` (n,) N m/rad varies in time."""
    tau = seen.joint_torque(seen.tau)[:, joint - 1]
    k = torch.maximum(by_joint_motion(seen, joint, 0) + stiffness, BUCKLED * stiffness)
    if seen.motion.steady or len(tau) < 4:
        still = torch.zeros_like(tau)
        return -tau / k, still, still
    J, D = by_joint_motion(seen, joint, 2).clamp_min(LIGHTEST), by_joint_motion(seen, joint, 1)
    t = seen.motion.t.numpy()
    turn, rate, change = oscillator(t, *(x.numpy() for x in (J, D + damping, k, -tau)))
    return tensor(turn), tensor(rate), tensor(change)


def oscillator(t: Array, J: Array, c: Array, k: Array, load: Array) -> tuple[Array, Array, Array]:
    """x, dx/dt, d2x/dt2 (n,) of J x'' + c x' + k x = load at even times `t` (n,), by the trapezoidal rule in one banded system."""
    from scipy.interpolate import CubicSpline
    from scipy.linalg import solve_banded

    dt = float(t[-1] - t[0]) / (len(t) - 1)
    slow = CubicSpline(t, load / k)
    still = [slow(t, order) for order in range(3)]
    still[0] -= (c * still[1] + J * still[2]) / k  # the motion that does not ring, to first order in its curvature
    each = max(1, int(np.ceil(dt * np.sqrt(np.median(k / J)) / STEP)))
    if each > MOST_STEPS:
        return still[0], still[1], still[2]
    fine = np.linspace(t[0], t[-1], (len(t) - 1) * each + 1)
    a, b, f = (np.interp(fine, t, c / J), np.interp(fine, t, k / J), CubicSpline(t, load / J)(fine))
    h, n = dt / each / 2, len(fine)
    bands, right = np.zeros((6, 2 * n)), np.empty(2 * n)  # unknowns x_0, v_0, x_1, v_1, ...; bands[2 + i - j, j] holds row i, column j
    bands[2, 0::2], bands[1, 1::2], bands[4, 0:-2:2], bands[3, 1:-2:2] = 1.0, -h, -1.0, -h  # x_i - x_(i-1) = h (v_i + v_(i-1))
    bands[2, 1::2], bands[3, 0::2] = 1.0 + h * a, h * b  # v_i - v_(i-1) = h (v'_i + v'_(i-1)),   v' = f - a v - b x
    bands[4, 1:-2:2], bands[5, 0:-2:2] = -1.0 + h * a[:-1], h * b[:-1]
    right[0::2], right[1::2] = 0.0, h * np.concatenate([[0.0], f[1:] + f[:-1]])
    bands[1, 1], bands[3, 0], bands[2, 1] = 0.0, 0.0, 1.0
    right[0], right[1] = float(slow(t[0])), 0.0
    both = solve_banded((3, 2), bands, right)
    x, v = both[0::2], both[1::2]
    return x[::each], v[::each], (f - a * v - b * x)[::each]
