"""Sufficient statistics of a linear torque model, summed over segments so that memory does not grow with the recordings.

    tau = c_0 + X theta + e,   X (n, joints, p) the columns of all linear terms as the sensors and the filter see them

    H_j = sum X_j' X_j,  g_j = sum X_j' (tau_j - c_0j),  s_j = sum (tau_j - c_0j)^2,  n     a joint
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.transmission import gear_factor, to_drives
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Statistics:
    """Gram sums of one block of rows (a recording, a group of steady runs)."""

    H: Array  # (joints, p, p)
    g: Array  # (joints, p)
    s: Array  # (joints,)
    n: Array  # (joints,)

    def __add__(self, other: "Statistics") -> "Statistics":
        return Statistics(self.H + other.H, self.g + other.g, self.s + other.s, self.n + other.n)


def total(blocks: Iterable[Statistics]) -> Statistics:
    """Return the sum of at least one block."""
    first, *rest = blocks
    return sum(rest, start=first)


def columns_and_offset(loads: Loads, segment: Segment, arm: Arm) -> tuple[Array, Array]:
    """Return X (n, joints, p) of the linear terms and the torque c_0 (n, joints) of the others, as sensors and filter see them.

    A gear's losses take their direction from the measured torque, which has the sign of the drive's.
    """
    flow = Flow(arm, Motion.of(segment))
    linear = loads.linear()
    measured = segment.tau_raw if segment.tau_raw is not None else segment.tau
    factor = gear_factor(tensor(measured) if measured is not None else torch.zeros_like(flow.motion.q), flow.motion.qd, arm)
    X = torch.cat([term.columns(flow) for term in linear.values()], dim=2) if linear else torch.zeros(*segment.q.shape, 0)
    fixed = Loads({name: term for name, term in loads.terms.items() if name not in linear}).torque(flow)
    seen = segment.filter(torch.cat([to_drives(X, arm) * factor[..., None], (to_drives(fixed, arm) * factor)[..., None]], dim=2).numpy())
    return seen[..., :-1], seen[..., -1]


def block(X: Array, y: Array) -> Statistics:
    """Return the statistics of the columns X (n, joints, p) and the torque y (n, joints)."""
    Xj, yj = X.transpose(1, 0, 2), y.T
    return Statistics(Xj.transpose(0, 2, 1) @ Xj, (Xj.transpose(0, 2, 1) @ yj[..., None])[..., 0], (yj**2).sum(axis=1),
                      np.full(len(yj), float(y.shape[0])))


def of_segment(loads: Loads, segment: Segment, arm: Arm, rows: NDArray[np.bool_] | None = None) -> Statistics:
    """Return the statistics of the compared rows of a segment (of those, `rows` (n,) where given)."""
    return of_columns(*columns_and_offset(loads, segment, arm), segment, rows)


def of_columns(X: Array, c0: Array, segment: Segment, rows: NDArray[np.bool_] | None = None) -> Statistics:
    """Return the same of what `columns_and_offset` gives."""
    keep = segment.keep if rows is None else segment.keep & rows
    assert segment.tau is not None
    return block(X[keep], segment.tau[keep] - c0[keep])


def weight_joints(stats: Statistics, weight: Array) -> tuple[Array, Array]:
    """Return H (p, p) and g (p,) summed over the joints with the weights (joints,)."""
    return np.einsum("j,jpq->pq", weight, stats.H), np.einsum("j,jp->p", weight, stats.g)


def residual_energy(stats: Statistics, theta: Array) -> Array:
    """Return sum e^2 (joints,) of the model `theta` (p,), from the sums alone."""
    energy: Array = stats.s - 2 * stats.g @ theta + np.einsum("p,jpq,q->j", theta, stats.H, theta)
    return np.maximum(energy, 0.0)


def by_name(names: Iterable[str], values: Array) -> Mapping[str, float]:
    """Return values (p,) by parameter name."""
    return dict(zip(names, values.tolist(), strict=True))
