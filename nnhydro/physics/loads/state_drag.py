"""Drag across each link with McLain & Rock's coefficient curve C_D(s/D): 0 at rest, five shaping points, one steady value.

    tau_j = sum_strips 1/2 rho D C_D(s/D) |w| w b_j ds              [N m]

    C_D(s/D) = sum_k d_k phi_k(s / (D tau_s)), C_D(0) = 0           (coefficients/travel_spline.py)
    b_j  lever of the strip about joint j                           [m]

Steady flow has s = infinity, C_D = ds. Holds for starts from rest; the curve's use through deceleration is the paper's, after a reversal it
is an assumption (physics/travel/travel.py). One travel scale `tau_s` for drag and added mass in the paper.
Start values and the bounds: the ordinates that reproduce the paper's figure 7 as quoted in its text; between them they are ours.
Source: McLain & Rock (1998), eqs. (25), (32), (33); in-line force 2-D theory: curve from rest at constant acceleration.
"""

from dataclasses import dataclass
from typing import ClassVar, final

from nnhydro.physics.load_term import Values, parameter
from nnhydro.physics.travel.spline_terms import SplineTerm

BOUNDS = (-1.0, 3.0)
TRAVEL = (2.0, 15.0)  # diameters: the peak of C_D lies near 4 and the arms of the paper swept 19


@final
@dataclass(frozen=True)
class StateDrag(SplineTerm):
    """Drag with C_D(s/D); each ordinate has one value for the arm, or one a link."""

    kind: ClassVar[str] = "state_drag"
    added_mass: ClassVar[bool] = False
    d1: Values = parameter("1", 0.43, BOUNDS, "C_D after tau_s / 6 diameters", per="arm")
    d2: Values = parameter("1", 0.894, BOUNDS, "C_D after 2 tau_s / 6 diameters", per="arm")
    d3: Values = parameter("1", 1.018, BOUNDS, "C_D after 3 tau_s / 6 diameters", per="arm")
    d4: Values = parameter("1", 0.809, BOUNDS, "C_D after 4 tau_s / 6 diameters", per="arm")
    d5: Values = parameter("1", 0.748, BOUNDS, "C_D after 5 tau_s / 6 diameters", per="arm")
    ds: Values = parameter("1", 0.78, BOUNDS, "steady C_D, from tau_s diameters on", per="arm")
    tau_s: Values = parameter("1", 8.0, TRAVEL, "travel in diameters after which C_D is steady", per="arm", linear=False)
