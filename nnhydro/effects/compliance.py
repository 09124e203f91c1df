"""A drive that gives way: the sensor reads the angle of the drive, the link is turned by a twist that depends on the torque.

    q_link = q_drive + twist(tau_j),   tau = tau(q_link, dq_link/dt, d2q_link/dt2)        solved by fixed-point iteration

The iteration converges below the resonance of link and drive; where it does not, the last round that came closer is kept.
"""

from collections.abc import Callable

import torch
from torch import Tensor

from nnhydro.effects.sensor_view import SensorView

ROUNDS = 8
DONE = 1e-6  # of the largest torque: far below any sensor


def direction(seen: SensorView, twist: Tensor, joint: int) -> Tensor:
    """Return `twist` (n,) rad as a change of all angles (n, joints)."""
    dq = torch.zeros_like(seen.motion.q)
    dq[:, joint - 1] = twist
    return dq


def turned_reading(seen: SensorView, joint: int, twist: Callable[[Tensor], Tensor]) -> Tensor:
    """Return the reading (n, joints) N m of an arm whose `joint` (from 1) twists by `twist(tau_j)` (n,) rad, tau_j at the joint."""
    def torque_at(turn: Tensor) -> Tensor:
        dq = direction(seen, turn, joint)
        dqd = seen.in_time(dq)
        return seen.torque_of(seen.flow_moved_by(dq, dqd, seen.in_time(dqd)))

    return _fixed_point(seen, joint, twist, torque_at)


def nearly_turned_reading(seen: SensorView, joint: int, twist: Callable[[Tensor], Tensor]) -> Tensor:
    """Return the reading to first order in the twist, from the derivatives of the torque alone: a third of the time."""
    return _fixed_point(seen, joint, twist, lambda turn: seen.tau + seen.along(turn, joint))


def _fixed_point(seen: SensorView, joint: int, twist: Callable[[Tensor], Tensor], torque_at: Callable[[Tensor], Tensor]) -> Tensor:
    """The reading at which the twist is that of its own torque; `torque_at(turn)` is the torque where the joint turns by so much."""
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
