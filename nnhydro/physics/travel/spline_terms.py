"""What drag and added mass share whose curve over the travel is McLain & Rock's spline, or a sum of B-splines.

A term declares its parameters: ordinates and `tau_s`, the travel in diameters from which the curve is constant.
Equations: coefficients/travel_spline.py and coefficients/travel_bspline.py.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from nnhydro.physics.coefficients import travel_bspline, travel_spline
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LinearTerm, Values
from nnhydro.physics.travel.term import TravelTerm


@dataclass(frozen=True)
class SplineTerm(TravelTerm, LinearTerm):
    """A term with five shaping points and a steady value; each ordinate has one value for the arm, or one per link."""

    if TYPE_CHECKING:  # declared by each term, after its ordinates
        tau_s: Values

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d ordinates, (n, joints, p)."""
        columns = self.basis_columns(flow, lambda s_over_D: travel_spline.basis(s_over_D, self.tau_s[0]))
        return self.arrange_columns(columns, tuple(len(getattr(self, field.name)) for field in self.linear_fields()))

    def curve(self, s_over_D: Tensor, link: int = 0) -> Tensor:
        """Return the coefficient beyond its value at rest at the travels `s_over_D` (...) of `link` (from 0)."""
        values = [getattr(self, field.name) for field in self.linear_fields()]
        ordinates = torch.tensor([v[link if len(v) > 1 else 0] for v in values], dtype=torch.float64)
        return travel_spline.curve(s_over_D, self.tau_s[0], 0.0, ordinates)

    def pieces(self) -> tuple[float, int]:
        """Return where the curve ends and its number of cubic pieces."""
        return self.tau_s[0], travel_spline.KNOTS


@dataclass(frozen=True)
class BsplineTerm(TravelTerm, LinearTerm):
    """A term with as many B-splines as `c` has values."""

    if TYPE_CHECKING:  # declared by each term
        c: Values
        tau_s: Values

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d c, (n, joints, K)."""
        return self.basis_columns(flow, lambda s_over_D: travel_bspline.basis(s_over_D, self.tau_s[0], len(self.c))).sum(2)

    def curve(self, s_over_D: Tensor, link: int = 0) -> Tensor:
        """Return the coefficient beyond its value at rest at the travels `s_over_D` (...); all links share it."""
        return travel_bspline.curve(s_over_D, self.tau_s[0], 0.0, torch.tensor(self.c, dtype=torch.float64))

    def pieces(self) -> tuple[float, int]:
        """Return where the curve ends and its number of cubic pieces."""
        return self.tau_s[0], travel_bspline.pieces(len(self.c))
