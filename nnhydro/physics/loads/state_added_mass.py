"""Inertia of the water with McLain & Rock's coefficient curve C_M(s/D): five shaping points and one steady value.

    tau_j = sum_strips rho pi D^2/4 [C_M(s/D) - phi_0] dw b_j ds     [N m]

    C_M(s/D) = 1 phi_0 + sum_k m_k phi_k(s / (D tau_s)), C_M(0) = 1  (coefficients/travel_spline.py)
    b_j  lever of the strip about joint j                            [m]

The part of the value at rest, 1 phi_0, holds no unknown: it is the term `state_at_rest`, which must stand in the same sum with the same
tau_s. Steady flow has s = infinity, C_M = ms. Acceleration as in the `document` reading of added_mass.py.
Start values: the ordinates that reproduce the paper's figure 7 as quoted in its text; between the quoted ones they are ours.
Source: McLain & Rock (1998), eqs. (26), (32), (33).
"""

from dataclasses import dataclass
from typing import ClassVar, final

from nnhydro.physics.load_term import Values, parameter
from nnhydro.physics.travel.spline_terms import SplineTerm

BOUNDS = (-1.0, 3.0)
TRAVEL = (2.0, 15.0)  # diameters


@final
@dataclass(frozen=True)
class StateAddedMass(SplineTerm):
    """Added mass with C_M(s/D), beyond its value at rest; each ordinate has one value for the arm, or one a link."""

    kind: ClassVar[str] = "state_added_mass"
    added_mass: ClassVar[bool] = True
    m1: Values = parameter("1", 0.84, BOUNDS, "C_M after tau_s / 6 diameters", per="arm")
    m2: Values = parameter("1", 0.46, BOUNDS, "C_M after 2 tau_s / 6 diameters", per="arm")
    m3: Values = parameter("1", 0.205, BOUNDS, "C_M after 3 tau_s / 6 diameters", per="arm")
    m4: Values = parameter("1", 0.276, BOUNDS, "C_M after 4 tau_s / 6 diameters", per="arm")
    m5: Values = parameter("1", 0.332, BOUNDS, "C_M after 5 tau_s / 6 diameters", per="arm")
    ms: Values = parameter("1", 0.36, BOUNDS, "steady C_M, from tau_s diameters on", per="arm")
    tau_s: Values = parameter("1", 8.0, TRAVEL, "travel in diameters after which C_M is steady", per="arm", linear=False)
