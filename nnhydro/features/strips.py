"""Loads along each link by strips: drag and added mass that may depend on the wake, link by link and with weight on the free end.

    X_ji = sum_s f_is b_jis ds / S_j                          torque of link i at drive j, scaled                        [1]

    drag     f = 1/2 rho D |x| y,   x, y in {w, a, b, a - b}      with span weight 1 and exp(-(L - x)/D)
    inertia  f = rho pi D^2/4 dw r, r in {1, a w, b w, a b, a^2, b^2} / (w^2 + a^2 + b^2)

    w, dw  normal speed and acceleration of the strip         [m/s, m/s^2]
    a, b   what its wake remembers over one and five diameters of travel (features/wake.py)                            [m/s]

C_D and C_M of McLain & Rock follow s/D through the ratios of w, a and b, so that a linear fit on these columns is strip theory with free
coefficient curves, and with relief near the free end, where water flows round the tip. Column (j, i) exists where link i loads drive j.
Source: McLain & Rock (1998), eqs. (1), (28); relief at ends: L/D effects in Rivera (1995), section 2; products and weights are ours.
"""

import torch
from torch import Tensor

from nnhydro.features.feature_set import Features, View, feature_set
from nnhydro.features.wake import LARGE, STILL, ends, memories, stations, strip_drag, strip_mass
from nnhydro.physics.flow import Flow
from nnhydro.physics.transmission import to_drives


def soft_limit(x: Tensor) -> Tensor:
    """Return x / sqrt(1 + (x/LARGE)^2): a link that stops in the wake of a fast motion has scaled loads without bound."""
    return x / torch.hypot(torch.ones_like(x), x / LARGE)


def link_columns(view: View, load: Tensor, x: Tensor, only: int | None = None) -> list[Tensor]:
    """Return the scaled torques (n,) of the strip loads `load` (n, links, s) N at `x` (links, s) m, one per pair of drive and link.

    `only` keeps the pairs of one link.
    """
    flow = view.flow
    torque = to_drives(flow.normal_columns(load.sum(dim=2), (load * x).sum(dim=2)), flow.arm)
    scaled = soft_limit(torque / view.scale[..., None])
    links = range(flow.arm.n_links) if only is None else (only,)
    return [scaled[:, j, i] for i in links for j in range(i + 1)]


def drag_loads(flow: Flow, speeds: list[Tensor]) -> list[Tensor]:
    """Return 1/2 rho D ds |x| y, (n, links, s) N, for all pairs of the `speeds` (n, links, s) m/s."""
    pressure = strip_drag(flow)
    return [pressure * x.abs() * y for x in speeds for y in speeds]


def inertia_loads(flow: Flow, x: Tensor, w: Tensor, a: Tensor, b: Tensor) -> list[Tensor]:
    """Return rho pi D^2/4 ds dw r, (n, links, s) N, for the six ratios r of the wake."""
    dw = flow.M[:, :, None] * x + flow.N[:, :, None]
    ideal = strip_mass(flow) * dw
    q = w**2 + a**2 + b**2 + STILL**2
    return [ideal, *(ideal * r / q for r in (a * w, b * w, a * b, a**2, b**2))]


@feature_set("strips")
def strips(view: View) -> Features:
    """Return the scaled torques of every load at every drive, all odd."""
    flow = view.flow
    x = stations(flow)
    w, remembered = memories(flow, x)
    a, b = ends(remembered)
    tip = torch.exp(-(flow.L[:, None] - x) / flow.D[:, None])
    columns: list[Tensor] = []
    for load in drag_loads(flow, [w, a, b, a - b]):
        columns += link_columns(view, load, x) + link_columns(view, load * tip, x)
    for load in inertia_loads(flow, x, w, a, b):
        columns += link_columns(view, load, x)
    odd = torch.stack(columns, dim=1)
    return Features(odd, odd[:, :0])
