"""The pressure of water that is itself accelerated: what pushes a link along with the water around it.

    f = - rho pi D^2/4 dv/dt                                [N/m], the drive's share (LOAD)

    dv/dt   acceleration of the water, as it was measured, everywhere alike                             [m/s^2]

Exact for links that are thin beside the flow's own scale; there is nothing to fit. Together with the added mass of the motion through the
water it makes the inertia part of Morison's force in moving water, 1 + C_M times the displaced mass on a link at rest.
Source: Rivera (1995), eq. 2-3; apart from the added mass, with C_p = 1: QBlade, Morison Equation,
https://github.com/QBladeOcean/QBladeOceanDocs, docs/source/src/theory/hydrodynamics/me/me.rst; the water's own acceleration, on a sphere:
Xu & Nadim (2015), Electron. J. Differ. Equ. 104, eq. 1.1, https://studylib.net/doc/10766668.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.flow import Flow, sum_over_links
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.loads.added_mass import displaced_mass


def pressure_columns(flow: Flow, ax: Tensor, ay: Tensor) -> Tensor:
    """Return the joint torques (n, joints, links) N m against water that accelerates by ax, ay m/s^2, broadcast to (n, links)."""
    mass = displaced_mass(flow) * flow.L
    across, along = flow.in_link_axes(ax, ay)
    return flow.middle_columns(-mass * across, -mass * along)


@final
@dataclass(frozen=True)
class WaterPressure(LoadTerm):
    """Displaced mass times the water's own acceleration; 0 where the water is at rest or flows steadily."""

    kind: ClassVar[str] = "water_pressure"

    def torque(self, flow: Flow) -> Tensor:
        """Return the joint torques (n, joints) N m."""
        if flow.motion.current is None:
            return torch.zeros_like(flow.motion.q)
        *_, ax, ay = flow.motion.current.at_links()
        return sum_over_links(pressure_columns(flow, ax, ay))
