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

from nnhydro.physics.coefficients.travel_spline import cardinal_matrix, powers, stretched
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.state_added_mass import StateAddedMass
from nnhydro.physics.loads.state_at_rest import StateAtRest
from nnhydro.physics.loads.state_drag import StateDrag
from nnhydro.physics.state_loads import with_tau_s
from nnhydro.physics.strips import Strips

Array = NDArray[np.float64]
Pair = tuple[Flow, Tensor]  # motion and joint torques (n, joints) N m (LOAD)
Rows = Callable[[tuple[float, ...]], tuple[Array, Array]]  # nu -> X (n, joints, p), y (n, joints)
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
    options = [{f.name: getattr(term, f.name) for f in term.options() if f.name != "count"} for term in terms]
    single = all(len(getattr(term, f.name)) == 1 for term in terms for f in term.parameters())
    return single and options[0] == options[1] == options[2]


def general(loads: Loads, pairs: Sequence[Pair]) -> Rows:
    """Return the rows of any sum of terms with a travel scale."""
    def rows(nu: tuple[float, ...]) -> tuple[Array, Array]:
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
    travels = torch.cat([state.s_over_D.flatten(1) for state in states])  # (n, links s)
    loads_of = [[drag.unit_load(state, added_mass=mass) for mass in (False, True)] for state in states]
    weights = torch.cat([torch.cat([to_joint_weights(state.strips, f) for f in both], dim=1)
                         for state, both in zip(states, loads_of, strict=True)])  # (n, 2 joints, links s)
    tau = torch.cat([torque for _, torque in pairs])
    joints, start = tau.shape[1], rest.C_M0[0]
    basis, at_rest = cardinal_matrix()[:, 1:], cardinal_matrix()[:, 0]
    whole = weights[:, joints:].sum(2)

    def rows(nu: tuple[float, ...]) -> tuple[Array, Array]:
        scales = nu if len(nu) == 2 else (*nu, *nu)
        if scales[0] == scales[1]:
            sums = (weights @ powers(stretched(travels, scales[0]))).tensor_split(2, dim=1)
        else:
            halves = weights.tensor_split(2, dim=1)
            sums = tuple(half @ powers(stretched(travels, tau_s)) for half, tau_s in zip(halves, scales, strict=True))
        X = torch.cat([part @ basis for part in sums], dim=2)
        return X.numpy(), (tau - start * (whole + sums[1] @ at_rest)).numpy()

    return rows
