"""A law of drag and added mass for every strip of the arm, linear in its coefficients, which all links and joints share.

    f = 1/2 rho D |w| w sum_p c_p phi_p(z) + rho pi D^2/4 dw sum_p m_p phi_p(z)        [N/m]
    tau_j = sum over strips of f ds times the strip's lever about joint j, behind belt and gears           [N m]

    z        variables of the strip's state (strip_state.py), even and bounded; w, dw its normal speed and acceleration
    phi_p    1, z_i, z_i z_k, and z_i z_k z_l of variables of degree 3

A law of the flow past a piece of cylinder, whichever link it belongs to: what link 2 shows of it, link 1 need not show again. The torque is
odd under the mirror for any coefficients and zero at rest. Source: McLain & Rock (1998), eqs. (1), (28); a law of more variables inside
the strip integral: the idea of arXiv 2509.13783; the polynomial is ours.
"""

from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations_with_replacement
from math import pi

import torch
from torch import Tensor

from nnhydro.features.scaling import gear_ratios
from nnhydro.features.strip_state import StripView
from nnhydro.features.wake import STRIPS
from nnhydro.physics.flow import Flow
from nnhydro.physics.transmission import to_drives

LOADS = 2  # drag and inertia
CHUNK = 128  # rows at a time: their products stay in the processor's cache


@lru_cache(maxsize=32)
def _products(k: int, of_three: tuple[int, ...]) -> tuple[Tensor, ...]:
    """Indices a, b (pairs,) of the variables to multiply, and c, d (triples,): a pair of variables of degree 3 and a third one."""
    pairs = list(combinations_with_replacement(range(k), 2))
    place = {pair: i for i, pair in enumerate(pairs)}
    triples = [(place[a, b], c) for a, b, c in combinations_with_replacement(of_three, 3)]
    return tuple(torch.tensor([one[side] for one in chosen], dtype=torch.long) for chosen in (pairs, triples) for side in (0, 1))


def size(k: int, of_three: Sequence[int]) -> int:
    """Return how many monomials there are of k variables, those at `of_three` of degree 3."""
    a, _, c, _ = _products(k, tuple(of_three))
    return 1 + k + len(a) + len(c)


def monomials(z: Tensor, of_three: Sequence[int]) -> Tensor:
    """Return phi (n, links, p, s) of the variables z (n, links, k, s)."""
    a, b, c, d = _products(z.shape[2], tuple(of_three))
    two = z.index_select(2, a) * z.index_select(2, b)
    three = two.index_select(2, c) * z.index_select(2, d)
    one = torch.ones_like(two[:, :, :1]) if len(a) else z.new_ones((*z.shape[:2], 1, z.shape[3]))
    return torch.cat([one, z, two, three], dim=2)


def unit_loads(view: StripView) -> Tensor:
    """Return the strip loads (n, links, 2, s) N for C_D = 1 and for C_M = 1."""
    flow = view.flow
    dw = flow.M[:, :, None] * view.x + flow.N[:, :, None]
    ds, D = (flow.L / STRIPS)[:, None], flow.D[:, None]
    return torch.stack([0.5 * flow.rho * D * ds * view.w.abs() * view.w, flow.rho * pi / 4 * D**2 * ds * dw], dim=2)


def to_sensors(flow: Flow, force: Tensor, moment: Tensor) -> Tensor:
    """Return the sensor torques (n, joints, p) of normal loads: force N and moment N m about the link's own joint, (n, links, p) each."""
    joint = torch.einsum("ji,nip->njp", flow.outboard, moment) + torch.einsum("nji,nip->njp", flow.lever_normal, force)
    return to_drives(joint, flow.arm) / gear_ratios(flow.arm)[:, None]


def law_columns(view: StripView, z: Tensor, of_three: Sequence[int]) -> Tensor:
    """Return d tau / d coefficient (n, joints, 2 p) N m: all of drag, then all of inertia."""
    loads = unit_loads(view)
    both = torch.cat([loads, loads * view.x[:, None]], dim=2)  # (n, links, 4, s)
    pieces = zip(torch.split(both, CHUNK), torch.split(z, CHUNK), strict=True)
    sums = torch.cat([part @ monomials(state, of_three).transpose(2, 3) for part, state in pieces])
    return torch.cat([to_sensors(view.flow, sums[:, :, load], sums[:, :, LOADS + load]) for load in range(LOADS)], dim=2)


def law_torque(view: StripView, z: Tensor, of_three: Sequence[int], coefficients: Tensor) -> Tensor:
    """Return the torques (E, n, joints) N m of E sets of `coefficients` (E, 2 p)."""
    E = len(coefficients)
    c = coefficients.reshape(E * LOADS, -1)
    C = torch.cat([c @ monomials(state, of_three) for state in torch.split(z, CHUNK)])
    C = C.reshape(*C.shape[:2], E, LOADS, -1)
    f = (C * unit_loads(view)[:, :, None]).sum(dim=3)  # (n, links, E, s) N
    return to_sensors(view.flow, f.sum(dim=3), (f * view.x[:, None]).sum(dim=3)).permute(2, 0, 1)
