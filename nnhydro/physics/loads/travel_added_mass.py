"""Inertia of the water with a coefficient curve over the travel, C_M(s/D), 1 at rest.

    tau_j = sum_strips rho pi D^2/4 C_M(s/D) dw b_j ds               [N m],   C_M = C_M0 phi_0 + sum_k m_k phi_k(s / (D tau_s))

    StateAtRest       C_M0 phi_0, known: 1 before the wake forms, fading as the curve's own points take over; not fitted
    StateAddedMass    the rest of the paper's curve, five shaping points and one steady value (coefficients/travel_spline.py)
    BsplineAddedMass  the rest of a curve of as many penalised B-splines as `c` has values (coefficients/travel_bspline.py)
    b_j               lever of the strip about joint j               [m]

A curve is the sum of StateAtRest and one of the others, with the same tau_s (and with `count` the number of B-splines; 0 for the
paper's curve).
Steady flow has s = infinity, C_M = ms. Acceleration as in the `document` reading of added_mass.py.
Start values: the ordinates that reproduce the paper's figure 7 as quoted in its text; between the quoted ones they are ours.
Source: McLain & Rock (1998), eqs. (1), (26), (32), (33); at s = 0: no vortices, C_M = 1; the form of the B-spline curve is ours.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.coefficients import travel_bspline, travel_spline
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import Values, parameter
from nnhydro.physics.travel.spline_terms import BsplineTerm, SplineTerm
from nnhydro.physics.travel.term import TravelTerm


@final
@dataclass(frozen=True)
class StateAtRest(TravelTerm):
    """Added mass of a wake that has not formed yet."""

    kind: ClassVar[str] = "state_at_rest"
    added_mass: ClassVar[bool] = True
    C_M0: Values = parameter("1", 1.0, (0.0, 2.0), "C_M of a start from rest (ideal 1)", per="arm", linear=False)
    tau_s: Values = parameter("1", 8.0, (2.0, 15.0), "travel in diameters after which the curves are steady", per="arm", linear=False)
    count: int = 0  # 0: the paper's spline; else the number of free B-splines

    def torque(self, flow: Flow) -> Tensor:
        """Return the joint torques (n, joints) N m."""
        return self.basis_columns(flow, lambda s_over_D: self.curve(s_over_D)[..., None]).sum((2, 3))

    def curve(self, s_over_D: Tensor, link: int = 0) -> Tensor:
        """Return C_M0 phi_0 at the travels `s_over_D` (...); all links share it."""
        tau_s = self.tau_s[0]
        if self.count:
            return self.C_M0[0] * travel_bspline.rest_curve(s_over_D, tau_s, self.count)
        return travel_spline.curve(s_over_D, tau_s, self.C_M0[0], torch.zeros(travel_spline.KNOTS, dtype=torch.float64))

    def pieces(self) -> tuple[float, int]:
        """Return where the curve ends and its number of cubic pieces."""
        return self.tau_s[0], travel_bspline.pieces(self.count) if self.count else travel_spline.KNOTS


BOUNDS = (-1.0, 3.0)
TRAVEL = (2.0, 15.0)  # diameters


@final
@dataclass(frozen=True)
class StateAddedMass(SplineTerm):
    """Added mass with C_M(s/D), beyond its value at rest; each ordinate has one value for the arm, or one per link."""

    kind: ClassVar[str] = "state_added_mass"
    added_mass: ClassVar[bool] = True
    m1: Values = parameter("1", 0.84, BOUNDS, "C_M after tau_s / 6 diameters", per="arm")
    m2: Values = parameter("1", 0.46, BOUNDS, "C_M after 2 tau_s / 6 diameters", per="arm")
    m3: Values = parameter("1", 0.205, BOUNDS, "C_M after 3 tau_s / 6 diameters", per="arm")
    m4: Values = parameter("1", 0.276, BOUNDS, "C_M after 4 tau_s / 6 diameters", per="arm")
    m5: Values = parameter("1", 0.332, BOUNDS, "C_M after 5 tau_s / 6 diameters", per="arm")
    ms: Values = parameter("1", 0.36, BOUNDS, "steady C_M, from tau_s diameters on", per="arm")
    tau_s: Values = parameter("1", 8.0, TRAVEL, "travel in diameters after which C_M is steady", per="arm", linear=False)


@final
@dataclass(frozen=True)
class BsplineAddedMass(BsplineTerm):
    """Added mass with C_M(s/D) of as many B-splines as `c` has values."""

    kind: ClassVar[str] = "bspline_added_mass"
    added_mass: ClassVar[bool] = True
    c: Values = parameter("1", 0.4, (-3.0, 5.0), "coefficients of the B-splines of C_M(s/D)", per="arm")
    tau_s: Values = parameter("1", 10.0, (2.0, 40.0), "travel in diameters after which C_M is steady", per="arm", linear=False)
