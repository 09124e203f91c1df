"""Inertia of the water with a free coefficient curve C_M(s/D) of K penalised B-splines, beyond the known value at rest.

    tau_j = sum_strips rho pi D^2/4 [C_M(s/D) - b_0] dw b_j ds,   C_M(s/D) = 1 b_0 + sum_k c_k b_k(s / (D tau_s))       [N m]

K is the number of values of `c`; the term `state_at_rest` with count = K carries b_0 (coefficients/travel_bspline.py).
Source: McLain & Rock (1998), eq. (1); the form of the curve is ours.
"""

from dataclasses import dataclass
from typing import ClassVar, final

from torch import Tensor

from nnhydro.physics.coefficients.travel_bspline import basis
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LinearTerm, Values, parameter
from nnhydro.physics.travel_term import TravelTerm, strip_columns


@final
@dataclass(frozen=True)
class BsplineAddedMass(TravelTerm, LinearTerm):
    """Added mass with C_M(s/D) of as many B-splines as `c` has values."""

    kind: ClassVar[str] = "bspline_added_mass"
    c: Values = parameter("1", 0.4, (-3.0, 5.0), "coefficients of the B-splines of C_M(s/D)", per="arm")
    tau_s: Values = parameter("1", 10.0, (2.0, 40.0), "travel in diameters after which C_M is steady", per="arm", linear=False)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d c, (n, joints, K)."""
        state = self.state(flow)
        phi = basis(state.s_over_D, self.tau_s[0], len(self.c))
        return strip_columns(state.strips, self.unit_load(state, added_mass=True), phi).sum(2)
