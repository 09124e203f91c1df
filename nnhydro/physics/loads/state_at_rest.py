"""The known part of the added mass over the travel: C_M = 1 before the wake forms, fading as the curve's own points take over.

    tau_j = sum_strips rho pi D^2/4 C_M0 phi_0(s/D) dw b_j ds        [N m]

    phi_0  1 at rest, 0 at every further point of the curve          (coefficients/travel_spline.py; travel_bspline.py for count > 0)

It stands beside `state_added_mass` (or `bspline_added_mass`, with the same `count`) and shares its tau_s; it is not fitted.
Source: McLain & Rock (1998), eq. (26) at s = 0: no vortices, C_M = 1.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.coefficients import travel_bspline, travel_spline
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import Values, parameter
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
