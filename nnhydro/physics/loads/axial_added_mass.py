"""Inertia of the water that is pushed along each link, in the three readings of `added_mass`.

    f_x = C_Mx m' int_0^L a_x dx,   m' = rho pi D^2 / 4     [N], along e_i

    document   a_x = d(u_x)/dt;   inertial   a_x = d(u_x)/dt - A (A x + B)
    energy     m' L [d(u_x)/dt a_ji + u_x (A_i l_ji - B_i)] at joint j; a_ji, l_ji levers of axial and normal loads

Source: Rivera (1995), eqs. 3-1-40 to 3-1-43; the inertial and energy readings are ours.
"""

from dataclasses import dataclass
from typing import ClassVar, final

from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LinearTerm, Values, parameter
from nnhydro.physics.loads.added_mass import displaced_mass, require_reading


@final
@dataclass(frozen=True)
class AxialAddedMass(LinearTerm):
    """Added mass along each link; `reading` must be that of the `AddedMass` beside it."""

    kind: ClassVar[str] = "axial_added_mass"
    row_by_row = True
    C_Mx: Values = parameter("1", 0.03, (0.0, 5.0), "added-mass coefficient along the link")
    reading: str = "document"

    def __post_init__(self) -> None:
        super().__post_init__()
        require_reading(self.reading)

    def loads(self, flow: Flow) -> Tensor:
        """Return the force (n, links) N along e_i for C_Mx = 1; in the energy reading what the document's acceleration gives."""
        mL = displaced_mass(flow) * flow.L
        if self.reading == "inertial":
            return mL * (flow.du_x - flow.A * (flow.A * flow.L / 2 + flow.B))
        return mL * flow.du_x

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d C_Mx, (n, joints, links)."""
        columns = flow.axial_columns(self.loads(flow))
        if self.reading != "energy":
            return columns
        slip = flow.A[:, None, :] * flow.lever_normal - flow.outboard * flow.B[:, None, :]
        return columns + (displaced_mass(flow) * flow.L * flow.u_x)[:, None, :] * slip
