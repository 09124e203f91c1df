"""Drag of the flow across each link, in closed form for a normal velocity that is linear along the link.

    F_i  = 1/2 rho D_i C_D,i int_0^L |A x + B| (A x + B) dx         [N]
    Mo_i = 1/2 rho D_i C_D,i int_0^L |A x + B| (A x + B) x dx       [N m], about the link's own joint

The velocity changes sign at x = -B/A: where that lies on the link the integral is split (case II), else not (case I). Polynomials in x
are used instead of cubes over 3A, so that A = 0 (a tow with locked joints) and B = 0 (pure rotation) are ordinary cases, and the sign is
taken in the interior of each piece, so that a tip at rest does not lose its drag.

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
    split = torch.where(A != 0, -B / torch.where(A != 0, A, torch.ones_like(A)), torch.zeros_like(A)).clamp(min=0.0)
    split = torch.minimum(split, L.expand_as(split))
    zero = torch.zeros_like(split)

    def piece(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
        sign = torch.sign(A * (a + b) / 2 + B)

        def moment(p: int) -> Tensor:  # int_a^b (A x + B)^2 x^p dx
            def antiderivative(x: Tensor) -> Tensor:
                return x ** (p + 1) * (A**2 * x**2 / (p + 3) + 2 * A * B * x / (p + 2) + B**2 / (p + 1))

            return antiderivative(b) - antiderivative(a)

        return sign * moment(0), sign * moment(1)

    (f1, m1), (f2, m2) = piece(zero, split), piece(split, L.expand_as(split))
    return f1 + f2, m1 + m2


@final
@dataclass(frozen=True)
class NormalDrag(LinearTerm):
    """Cross-flow drag with one coefficient a link."""

    kind: ClassVar[str] = "normal_drag"
    C_D: Values = parameter("1", 1.1, (0.0, 5.0), "cross-flow drag coefficient, reference area L D")

    def loads(self, flow: Flow) -> tuple[Tensor, Tensor]:
        """Return force (n, links) N along n_i and moment (n, links) N m about the link's own joint, for C_D = 1."""
        force, moment = signed_square_integrals(flow.A, flow.B, flow.L)
        k = 0.5 * flow.rho * flow.D
        return k * force, k * moment

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d C_D, (n, joints, links)."""
        return flow.normal_columns(*self.loads(flow))
