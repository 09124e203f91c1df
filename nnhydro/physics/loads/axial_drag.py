"""Drag of the flow along each link: skin friction and, for the outer link, its blunt end.

    f_x,i = 1/2 rho D_i L_i C_Dx,i |u_x,i| u_x,i            [N], along e_i

The coefficient refers to L D, not to the wetted area: skin friction alone gives C_Dx = pi C_f, 0.01 to 0.05. The load passes through
the link's own joint and turns the inboard ones only. Source: Rivera (1995), eqs. 3-1-27 to 3-1-29.
"""

from dataclasses import dataclass
from typing import ClassVar, final

from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LinearTerm, Values, parameter


@final
@dataclass(frozen=True)
class AxialDrag(LinearTerm):
    """Axial drag with one coefficient per link."""

    kind: ClassVar[str] = "axial_drag"
    row_by_row = True
    C_Dx: Values = parameter("1", 0.03, (0.0, 2.0), "axial drag coefficient, reference area L D")

    def loads(self, flow: Flow) -> Tensor:
        """Return the force (n, links) N along e_i for C_Dx = 1."""
        return 0.5 * flow.rho * flow.D * flow.L * flow.u_x.abs() * flow.u_x

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d C_Dx, (n, joints, links)."""
        return flow.axial_columns(self.loads(flow))
