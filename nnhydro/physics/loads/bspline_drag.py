"""Drag across each link with a free coefficient curve C_D(s/D) of K penalised B-splines, 0 at rest: for more data than twelve slews.

    tau_j = sum_strips 1/2 rho D C_D(s/D) |w| w b_j ds,   C_D(s/D) = sum_k c_k b_k(s / (D tau_s))       [N m]

K is the number of values of `c`; the curve is the arm's, constant beyond `tau_s` diameters (coefficients/travel_bspline.py).
Source: McLain & Rock (1998), eq. (1); the form of the curve is ours.
"""

from dataclasses import dataclass
from typing import ClassVar, final

from nnhydro.physics.load_term import Values, parameter
from nnhydro.physics.travel.spline_terms import BsplineTerm


@final
@dataclass(frozen=True)
class BsplineDrag(BsplineTerm):
    """Drag with C_D(s/D) of as many B-splines as `c` has values."""

    kind: ClassVar[str] = "bspline_drag"
    added_mass: ClassVar[bool] = False
    c: Values = parameter("1", 0.8, (-3.0, 5.0), "coefficients of the B-splines of C_D(s/D)", per="arm")
    tau_s: Values = parameter("1", 10.0, (2.0, 40.0), "travel in diameters after which C_D is steady", per="arm", linear=False)
