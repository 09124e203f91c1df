"""Torques of Lagrange's equations by automatic differentiation of an energy: shares nothing with the load terms but the motion.

    tau = d/dt dT/dqd - dT/dq + dV/dq,   d/dt dT/dqd = T_qdqd qdd + T_qdq qd + T_qdy y' + T_qdu du0
"""

from collections.abc import Callable

import torch
from torch import Tensor
from torch.func import grad, jacrev, vmap

from nnhydro.physics.motion import Motion

Energy = Callable[[Tensor, Tensor, Tensor], Tensor]  # of one state's q (links,), qd (links,), u0 ()


def lagrange_torque(kinetic: Energy, motion: Motion, potential: Callable[[Tensor], Tensor] | None = None) -> Tensor:
    """Return the torques (n, links) behind `motion` for the kinetic and potential energies of one state."""
    def one(q: Tensor, qd: Tensor, qdd: Tensor, u0: Tensor, du0: Tensor) -> Tensor:
        by_q, by_qd, by_u0 = jacrev(grad(kinetic, argnums=1), argnums=(0, 1, 2))(q, qd, u0)
        tau = by_qd @ qdd + by_q @ qd + by_u0 * du0 - grad(kinetic, argnums=0)(q, qd, u0)
        return tau if potential is None else tau + grad(potential)(q)

    return vmap(one)(motion.q, motion.qd, motion.qdd, motion.u0, motion.du0)


def joints_of(q: Tensor, L: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Return absolute angles (links,), unit vectors along the links and positions of their inboard joints (links, 2)."""
    phi = q.cumsum(0)
    e = torch.stack([phi.cos(), phi.sin()], dim=-1)
    reach = L[:, None] * e
    return phi, e, reach.cumsum(0) - reach


def velocity_of(point: Callable[[Tensor], Tensor], q: Tensor, qd: Tensor, u0: Tensor) -> Tensor:
    """Return the velocity of `point(q)` (..., 2) in world axes, the carriage moving along +Y at `u0`."""
    return jacrev(point)(q) @ qd + torch.stack([torch.zeros_like(u0), u0])
