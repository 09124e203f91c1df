"""Inertia of the water with a free coefficient curve C_M(s/D) of K penalised B-splines, beyond the known value at rest.

    tau_j = sum_strips rho pi D^2/4 [C_M(s/D) - b_0] dw b_j ds,   C_M(s/D) = 1 b_0 + sum_k c_k b_k(s / (D tau_s))       [N m]

K is the number of values of `c`; the term `state_at_rest` with count = K carries b_0 (coefficients/travel_bspline.py).
Source: McLain & Rock (1998), eq. (1); the form of the curve is ours.
"""

from dataclasses import dataclass
from typing import ClassVar, final

from nnhydro.physics.load_term import Values, parameter
from nnhydro.physics.travel.spline_terms import BsplineTerm


@final
@dataclass(frozen=True)
class BsplineAddedMass(BsplineTerm):
    """Added mass with C_M(s/D) of as many B-splines as `c` has values."""

    kind: ClassVar[str] = "bspline_added_mass"
    added_mass: ClassVar[bool] = True
    c: Values = parameter("1", 0.4, (-3.0, 5.0), "coefficients of the B-splines of C_M(s/D)", per="arm")
    tau_s: Values = parameter("1", 10.0, (2.0, 40.0), "travel in diameters after which C_M is steady", per="arm", linear=False)
