"""Drag across each link with a coefficient curve over the travel, C_D(s/D), 0 at rest.

    tau_j = sum_strips 1/2 rho D C_D(s/D) |w| w b_j ds              [N m]

    StateDrag    C_D = sum_k d_k phi_k(s / (D tau_s)): the paper's five shaping points and one steady value (coefficients/travel_spline.py)
    BsplineDrag  C_D = sum_k c_k b_k(s / (D tau_s)): as many penalised B-splines as `c` has values (coefficients/travel_bspline.py)
    b_j          lever of the strip about joint j                   [m]

Steady flow has s = infinity, C_D = ds. Holds for starts from rest; the curve's use through deceleration is the paper's, after a reversal it
is an assumption (physics/travel/travel.py). The curve is constant beyond `tau_s` diameters; drag and added mass share it in the paper.
Start values and the bounds: the ordinates that reproduce the paper's figure 7 as quoted in its text; between them they are ours. B-splines
are for more data than the paper's twelve slews.
Source: McLain & Rock (1998), eqs. (1), (25), (32), (33); in-line force 2-D theory: curve from rest at constant acceleration; the form of
the B-spline curve is ours.
"""

from dataclasses import dataclass
from typing import ClassVar, final

from nnhydro.physics.load_term import Values, parameter
from nnhydro.physics.travel.spline_terms import BsplineTerm, SplineTerm

BOUNDS = (-1.0, 3.0)
TRAVEL = (2.0, 15.0)  # diameters: the peak of C_D lies near 4 and the arms of the paper swept 19


@final
@dataclass(frozen=True)
class StateDrag(SplineTerm):
    """Drag with C_D(s/D); each ordinate has one value for the arm, or one per link."""

    kind: ClassVar[str] = "state_drag"
    added_mass: ClassVar[bool] = False
    d1: Values = parameter("1", 0.43, BOUNDS, "C_D after tau_s / 6 diameters", per="arm")
    d2: Values = parameter("1", 0.894, BOUNDS, "C_D after 2 tau_s / 6 diameters", per="arm")
    d3: Values = parameter("1", 1.018, BOUNDS, "C_D after 3 tau_s / 6 diameters", per="arm")
    d4: Values = parameter("1", 0.809, BOUNDS, "C_D after 4 tau_s / 6 diameters", per="arm")
    d5: Values = parameter("1", 0.748, BOUNDS, "C_D after 5 tau_s / 6 diameters", per="arm")
    ds: Values = parameter("1", 0.78, BOUNDS, "steady C_D, from tau_s diameters on", per="arm")
    tau_s: Values = parameter("1", 8.0, TRAVEL, "travel in diameters after which C_D is steady", per="arm", linear=False)


@final
@dataclass(frozen=True)
class BsplineDrag(BsplineTerm):
    """Drag with C_D(s/D) of as many B-splines as `c` has values."""

    kind: ClassVar[str] = "bspline_drag"
    added_mass: ClassVar[bool] = False
    c: Values = parameter("1", 0.8, (-3.0, 5.0), "coefficients of the B-splines of C_D(s/D)", per="arm")
    tau_s: Values = parameter("1", 10.0, (2.0, 40.0), "travel in diameters after which C_D is steady", per="arm", linear=False)
