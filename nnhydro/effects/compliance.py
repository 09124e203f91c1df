"""A drive that gives way: the sensor reads the angle of the drive, the link is turned by a twist that depends on the torque.

    q_link = q_drive + twist(tau_j),   tau = tau(q_link, dq_link/dt, d2q_link/dt2)        solved by fixed-point iteration

The iteration converges below the resonance of link and drive; where it does not, the last round that came closer is kept.
"""

from collections.abc import Callable

import torch
from torch import Tensor

from nnhydro.effects.sensor_view import SensorView

ROUNDS = 8
DONE = 1e-10  # of the largest torque


def direction(seen: SensorView, twist: Tensor, joint: int) -> Tensor:
    """Return `twist` (n,) rad as a change of all angles (n, joints)."""
    dq = torch.zeros_like(seen.motion.q)
    dq[:, joint - 1] = twist
    return dq


def turned_reading(seen: SensorView, joint: int, twist: Callable[[Tensor], Tensor]) -> Tensor:
    """Return the reading (n, joints) N m of an arm whose `joint` (from 1) twists by `twist(tau_j)` (n,) rad, tau_j at the joint."""
    tau, size = seen.tau, float("inf")
    for _ in range(ROUNDS):
        dq = direction(seen, twist(seen.joint_torque(tau)[:, joint - 1]), joint)
        dqd = seen.in_time(dq)
        after = seen.torque_of(seen.moved(dq, dqd, seen.in_time(dqd)))
        change = float((after - tau).abs().max()) if len(tau) else 0.0
        if change > size:
            return tau
        tau, size = after, change
        if size <= DONE * float(seen.tau.abs().max() if len(tau) else 0.0):
            break
    return tau
