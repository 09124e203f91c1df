"""One link in the wake of another: drag of the strips that follow in the path of another link.

Seen from the water, a strip moves with velocity v. Going ahead from it along v, the line meets the axis of link p after the distance a, at
the place x_p along that link: if 0 < x_p < L_p and a > 0, link p has passed there before and left a wake, of half width and strength

    h = D_p/2 + 1/4 sqrt(C_D D_p a),    sigma = 1 / sqrt(1 + a/(k D_p)),  k = 2 and 8

    f = 1/2 rho D |w| y sigma inside(x_p / h) inside((L_p - x_p) / h) behind(a / D_p),   y in {w, a, b}        [N/m]

with smooth steps for inside and behind. Features are the torques of f over each pair (p, i) of neighbours and others, scaled; the variables
of a strip are its shares inside . behind . sigma, summed over the other links.
Source: Schlichting, Boundary-Layer Theory (plane wake: width ~ sqrt(C_D D x), deficit ~ 1/sqrt(x)); Rivera (1995), section 2 (tandem
cylinders); the geometry is ours.
"""

import torch
from torch import Tensor

from nnhydro.features.feature_set import Features, View, feature_set
from nnhydro.features.scaling import root
from nnhydro.features.strip_law.state import StripView, state_set
from nnhydro.features.strips import link_columns
from nnhydro.features.wake import STILL, ends, memories, stations, strip_drag
from nnhydro.physics.flow import Flow

ALONG = 0.1  # sine of the angle below which a strip runs along the other link instead of towards it
REACHES = (2.0, 8.0)  # diameters over which the wake fades
NEAREST = 1e-36  # m: lost beside any diameter; at 0 the root below would have no derivative


def strip_paths(flow: Flow, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Return position and velocity of each strip and the inboard joints' positions, complex: (n, links, s) m, m/s, (n, links) m."""
    e = torch.exp(1j * flow.phi)
    joints = torch.cumsum(flow.L * e, dim=1) - flow.L * e
    rx, ry = flow.through_water[:2]
    speed = rx + 1j * ry + torch.cumsum(1j * flow.A * flow.L * e, dim=1) - 1j * flow.A * flow.L * e
    position = joints[:, :, None] + x * e[:, :, None]
    return position, speed[:, :, None] + 1j * (flow.A * e)[:, :, None] * x, joints


def shielding(flow: Flow, x: Tensor, p: int, i: int) -> list[Tensor]:
    """Return for each reach how strongly the strips of link i (n, s) lie in the wake of link p, 0 to 1."""
    return flow.memo.of(("shielding", x.shape[1], p, i), lambda: _shielding(flow, x, p, i))


def _shielding(flow: Flow, x: Tensor, p: int, i: int) -> list[Tensor]:
    position, velocity, joints = flow.memo.of(("strip paths", x.shape[1]), lambda: strip_paths(flow, x))
    back = torch.exp(-1j * flow.phi[:, p, None])
    place, course = (position[:, i] - joints[:, p, None]) * back, velocity[:, i] * back
    speed = root(course.real**2 + course.imag**2)
    course = course / (speed + STILL)
    ahead = -place.imag * course.imag / (course.imag**2 + ALONG**2)
    meets = place.real + ahead * course.real
    D = flow.D[p]
    far = ahead.clamp(min=NEAREST)
    half = D / 2 + torch.sqrt(D * far) / 4
    inside = torch.sigmoid(2 * meets / half) * torch.sigmoid(2 * (flow.L[p] - meets) / half)
    behind = torch.sigmoid(4 * (ahead / D - 1))
    moving = speed**2 / (speed**2 + (10 * STILL) ** 2)
    return [inside * behind * moving / torch.sqrt(1 + far / (k * D)) for k in REACHES]


@feature_set("interference")
def interference(view: View) -> Features:
    """Return the scaled drag torques of shielded strips, all odd; none where there is one link."""
    flow = view.flow
    x = stations(flow)
    w, remembered = memories(flow, x)
    a, b = ends(remembered)
    pressure = strip_drag(flow)
    columns: list[Tensor] = []
    for i in range(flow.arm.n_links):
        for p in (p for p in range(flow.arm.n_links) if p != i):
            for share in shielding(flow, x, p, i):
                for y in (w, a, b):
                    load = torch.zeros_like(w)
                    load[:, i] = share * (pressure * w.abs() * y)[:, i]
                    columns += link_columns(view, load, x, i)
    odd = torch.stack(columns, dim=1) if columns else flow.motion.q[:, :0]
    return Features(odd, odd[:, :0])


def in_wakes(flow: Flow, x: Tensor) -> Tensor:
    """Return how strongly, from 0, strips lie in the wakes of other links, (n, links, reaches, s), at the `stations` x (links, s) m."""
    links = range(flow.arm.n_links)
    none = torch.zeros(len(flow.motion), len(REACHES), x.shape[1], dtype=torch.float64)

    def of_link(i: int) -> Tensor:
        return sum((torch.stack(shielding(flow, x, p, i), dim=1) for p in links if p != i), start=none)

    return flow.memo.of(("in_wakes", x.shape[1]), lambda: torch.stack([of_link(i) for i in links], dim=1))


@state_set("shadow")
def shadow(view: StripView) -> Tensor:
    """Return how strongly, from 0, each strip lies in the wakes of the other links, (n, links, reaches, s)."""
    return in_wakes(view.flow, view.x)
