"""Inertia of the water that is pushed aside by each link, in the three readings of the document's acceleration.

    f_y = C_M m' a_y(x),   m' = rho pi D^2 / 4              [N/m], along n_i

    document   a_y = M x + N: the scalar time derivative in the link's frame (the default)
    inertial   a_y = M x + N + A u_x: the normal component of the acceleration vector of the link's points
    energy     Lagrange's equations on the kinetic energy 1/2 m' int u_y^2 dx: attached flow, with the Munk moment; adds
               m' (A L^2/2 + B L) (u_x,i - A_i a_ji) at joint j, a_ji the lever of an axial load

All three agree for a single link on a hub at rest. C_M is the added-mass coefficient: 1 in ideal flow, not 2. The print's sgn() in
front of the signed integral (eqs. 3-1-33/34) is dropped: it would make the load positive for a decelerating link.
Source: Rivera (1995), eqs. 3-1-31 to 3-1-39; the inertial and energy readings are ours.
"""

from dataclasses import dataclass
from math import pi
from typing import ClassVar, final

from torch import Tensor

from nnhydro.errors import ModelError, require
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LinearTerm, Values, parameter

READINGS = ("document", "inertial", "energy")


def require_reading(reading: str) -> None:
    """Raise ModelError unless `reading` is one of the three."""
    require(reading in READINGS, f"added mass: reading {reading!r} is not one of {', '.join(READINGS)}", ModelError)


def displaced_mass(flow: Flow) -> Tensor:
    """Return the displaced mass per metre of each link, rho pi D^2/4, (links,) kg/m."""
    return flow.rho * pi * flow.D**2 / 4


def attached_flow(flow: Flow) -> Tensor:
    """Return what the energy reading adds to the document's, for C_M = 1, (n, joints, links) N m: the Munk moment among it."""
    momentum = displaced_mass(flow) * (flow.A * flow.L**2 / 2 + flow.B * flow.L)
    return momentum[:, None, :] * (flow.outboard * flow.u_x[:, None, :] - flow.A[:, None, :] * flow.lever_axial)


@final
@dataclass(frozen=True)
class AddedMass(LinearTerm):
    """Added mass across each link; `reading` says which acceleration is meant and is part of the model."""

    kind: ClassVar[str] = "added_mass"
    row_by_row = True
    C_M: Values = parameter("1", 1.0, (0.0, 5.0), "added-mass coefficient across the link (ideal 1)")
    reading: str = "document"

    def __post_init__(self) -> None:
        super().__post_init__()
        require_reading(self.reading)

    def loads(self, flow: Flow) -> tuple[Tensor, Tensor]:
        """Return force (n, links) N along n_i and moment (n, links) N m about the link's own joint, for C_M = 1."""
        N = flow.N + flow.A * flow.u_x if self.reading == "inertial" else flow.N
        m, L = displaced_mass(flow), flow.L
        return m * (flow.M * L**2 / 2 + N * L), m * (flow.M * L**3 / 3 + N * L**2 / 2)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d C_M, (n, joints, links)."""
        columns = flow.normal_columns(*self.loads(flow))
        return columns + attached_flow(flow) if self.reading == "energy" else columns
