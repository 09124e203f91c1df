"""Drag of the flow across each link, in closed form for a normal velocity that is linear along the link.

    F_i  = 1/2 rho D_i C_D,i int_0^L |A x + B| (A x + B) dx         [N]
    Mo_i = 1/2 rho D_i C_D,i int_0^L |A x + B| (A x + B) x dx       [N m], about the link's own joint

The velocity changes sign at x = -B/A: where that lies on the link the integral is split (case II), else not (case I). With the velocities
a = B at the link's own joint and b = A L + B at its tip the integrals are

    case I    F = s L (a^2 + a b + b^2)/3,            Mo = s L^2 (a^2 + 2 a b + 3 b^2)/12,                s = sgn(a + b)
    case II   F = s (b^2 h - a^2 x_0)/3,              Mo = s (b^2 h (3 h + 4 x_0) - a^2 x_0^2)/12,        s = sgn(b)
              x_0 = L a/(a - b), h = L - x_0

times 1/2 rho D C_D. There are no cubes over 3A: A = 0 (a tow with locked joints) and B = 0 (pure rotation) are ordinary cases, and a tip
at rest does not lose its drag.

Holds for KC > 30 and links longer than about five diameters. Source: Morison's drag term (Rivera 1995, eq. 2-3) integrated,
eqs. 3-1-15 to 3-1-26.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LinearTerm, Values, parameter


def signed_square_integrals(A: Tensor, B: Tensor, L: Tensor) -> tuple[Tensor, Tensor]:
    """Return int_0^L |w| w dx and int_0^L |w| w x dx for w = A x + B; A, B (n, links), L (links,)."""
    tip = A * L + B
    root_2, product, tip_2 = B * B, B * tip, tip * tip
    turns = product < 0  # case II: the velocity changes sign on the link
    split = L * torch.where(turns, B / torch.where(turns, B - tip, 1.0), 0.0)  # = -B/A
    rest = L - split
    force = torch.where(turns, tip_2 * rest - root_2 * split, L * (root_2 + product + tip_2))
    moment = torch.where(turns, tip_2 * rest * (3 * rest + 4 * split) - root_2 * split**2, L**2 * (root_2 + 2 * product + 3 * tip_2))
    sign = torch.sign(torch.where(turns, tip, B + tip))
    return sign * force / 3, sign * moment / 12


@final
@dataclass(frozen=True)
class NormalDrag(LinearTerm):
    """Cross-flow drag with one coefficient per link."""

    kind: ClassVar[str] = "normal_drag"
    row_by_row = True
    C_D: Values = parameter("1", 1.1, (0.0, 5.0), "cross-flow drag coefficient, reference area L D")

    def loads(self, flow: Flow) -> tuple[Tensor, Tensor]:
        """Return force (n, links) N along n_i and moment (n, links) N m about the link's own joint, for C_D = 1."""
        force, moment = signed_square_integrals(flow.A, flow.B, flow.L)
        k = 0.5 * flow.rho * flow.D
        return k * force, k * moment

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d C_D, (n, joints, links)."""
        return flow.normal_columns(*self.loads(flow))
