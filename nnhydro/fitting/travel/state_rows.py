"""The columns of the state-dependent model for many travel scales: all that does not depend on tau_s is computed once.

    X_k(tau_s) = sum_strips a_D phi_k(s / (D tau_s)),    a_D, a_M   joint torque of a strip for coefficient 1      [N m]

Motions are stacked, and the truncated powers of the travel are shared by drag, added mass and its known part: one pass over the strips a
value of tau_s instead of three a motion. Applies to sums with one pair of curves for the arm; others take the general path (`general`).
"""

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.physics.coefficients.travel_spline import KNOTS, cardinal_matrix
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.travel_added_mass import StateAddedMass, StateAtRest
from nnhydro.physics.loads.travel_drag import StateDrag
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.state_model import with_tau_s

Array = NDArray[np.float64]
Pair = tuple[Flow, Tensor]  # motion and joint torques (n, joints) N m (LOAD)
Rows = Callable[[tuple[float, ...]], tuple[Array, Array]]  # nu -> X (n, joints, p), y (n, joints)
BLOCK = 2048  # rows: ten strips of them and what is made of them fit a second-level cache
CURVES: Final = (StateDrag, StateAddedMass, StateAtRest)


def to_joint_weights(strips: Strips, f: Tensor) -> Tensor:
    """Return the joint torque (n, joints, links s) of each strip's load `f` (n, links, s) N/m."""
    flow = strips.flow
    arm_of_strip = flow.outboard[:, :, None] * strips.x + flow.lever_normal[..., None]  # (n, joints, links, s)
    return (arm_of_strip * (f * strips.ds[:, None])[:, None]).flatten(2)


def _shared_curves(loads: Loads) -> bool:
    """True where `loads` is drag, added mass and its known part with one curve each, all with the same options."""
    terms = tuple(loads.terms.values())
    if tuple(type(term) for term in terms) != CURVES or any(isinstance(term, StateAtRest) and term.count for term in terms):
        return False
    options = [{field.name: getattr(term, field.name) for field in term.options() if field.name != "count"} for term in terms]
    single = all(len(getattr(term, field.name)) == 1 for term in terms for field in term.parameters())
    return single and options[0] == options[1] == options[2]


def general(loads: Loads, pairs: Sequence[Pair]) -> Rows:
    """Return the rows of any sum of terms with a travel scale."""
    def rows(nu: tuple[float, ...]) -> tuple[Array, Array]:
        """Return columns (n, joints, p) and torques (n, joints) N m at the travel scales `nu`."""
        scaled = with_tau_s(loads, *nu)
        linear = scaled.linear()
        fixed = Loads({name: term for name, term in scaled.terms.items() if name not in linear})
        X = [torch.cat([term.columns(flow) for term in linear.values()], dim=2) for flow, _ in pairs]
        return torch.cat(X).numpy(), torch.cat([tau - fixed.torque(flow) for flow, tau in pairs]).numpy()

    return rows


def rows_of(loads: Loads, pairs: Sequence[Pair]) -> Rows:
    """Return the function nu -> rows of `loads` over all `pairs`, motions one after the other."""
    if not _shared_curves(loads):
        return general(loads, pairs)
    drag, _, rest = loads.terms.values()
    assert isinstance(drag, StateDrag)
    assert isinstance(rest, StateAtRest)
    states = [drag.state(flow) for flow, _ in pairs]
    travels = np.ascontiguousarray(torch.cat([state.s_over_D.flatten(1) for state in states]).numpy().T)  # (links s, n)
    by_kind = [torch.cat([to_joint_weights(state.strips, drag.unit_load(state, added_mass=mass)) for state in states])
               for mass in (False, True)]
    weights = np.ascontiguousarray(torch.cat(by_kind, dim=1).permute(1, 2, 0).numpy())  # (2 joints, links s, n): drag, inertia
    tau = torch.cat([torque for _, torque in pairs]).numpy()
    start, matrix = rest.C_M0[0], cardinal_matrix().numpy()
    joints = tau.shape[1]
    whole = weights[joints:].sum(1).T

    def rows(nu: tuple[float, ...]) -> tuple[Array, Array]:
        """Return columns (n, joints, p) and torques (n, joints) N m at the travel scales `nu`, of the shared curves."""
        if len(nu) == 1 or nu[0] == nu[1]:
            both = power_sums(travels / nu[0], weights)
        else:
            both = np.concatenate([power_sums(travels / nu[0], weights[:joints]), power_sums(travels / nu[1], weights[joints:])])
        cardinal = matrix.T @ both  # (2 joints, 7, n): phi_0 - 1, phi_1 ... phi_6
        X = np.concatenate([cardinal[:joints, 1:], cardinal[joints:, 1:]], axis=1).transpose(2, 0, 1)
        return X, tau - start * (whole + cardinal[joints:, 0].T)

    return rows


def power_sums(u: Array, weights: Array) -> Array:
    """Return sum_strips a phi (k, 7, n) of the `weights` (k, strips, n), phi the powers of the spline at `u` (strips, n).

    A block of rows and one power at a time, so that the work stays in the processor's cache.
    """
    sums = np.empty((len(weights), KNOTS + 1, u.shape[1]))
    for first in range(0, u.shape[1], BLOCK):
        rows = slice(first, first + BLOCK)
        block, a = np.minimum(u[:, rows], 1.0), weights[:, :, rows]
        sums[:, 0, rows] = (a * block).sum(1)
        for knot in range(KNOTS):
            ramp = np.maximum(block - knot / KNOTS, 0.0)
            sums[:, knot + 1, rows] = (a * (ramp * ramp * ramp)).sum(1)
    return sums
