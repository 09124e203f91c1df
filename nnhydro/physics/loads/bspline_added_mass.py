"""Inertia of the water with a free coefficient curve C_M(s/D) of K penalised B-splines, beyond the known value at rest.

    tau_j = sum_strips rho pi D^2/4 [C_M(s/D) - b_0] dw b_j ds,   C_M(s/D) = 1 b_0 + sum_k c_k b_k(s / (D tau_s))       [N m]

K is the number of values of `c`; the term `state_at_rest` with count = K carries b_0 (coefficients/travel_bspline.py).
Source: McLain & Rock (1998), eq. (1); the form of the curve is ours.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.coefficients.travel_bspline import basis, curve, pieces
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LinearTerm, Values, parameter
from nnhydro.physics.travel.term import TravelTerm


@final
@dataclass(frozen=True)
class BsplineAddedMass(TravelTerm, LinearTerm):
    """Added mass with C_M(s/D) of as many B-splines as `c` has values."""

    kind: ClassVar[str] = "bspline_added_mass"
    added_mass: ClassVar[bool] = True
    c: Values = parameter("1", 0.4, (-3.0, 5.0), "coefficients of the B-splines of C_M(s/D)", per="arm")
    tau_s: Values = parameter("1", 10.0, (2.0, 40.0), "travel in diameters after which C_M is steady", per="arm", linear=False)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d c, (n, joints, K)."""
        return self.basis_columns(flow, lambda s_over_D: basis(s_over_D, self.tau_s[0], len(self.c))).sum(2)

    def curve(self, s_over_D: Tensor, link: int = 0) -> Tensor:
        """Return C_M beyond its value at rest at the travels `s_over_D` (...); all links share it."""
        return curve(s_over_D, self.tau_s[0], 0.0, torch.tensor(self.c, dtype=torch.float64))

    def pieces(self) -> tuple[float, int]:
        """Return where the curve ends and its number of cubic pieces."""
        return self.tau_s[0], pieces(len(self.c))
