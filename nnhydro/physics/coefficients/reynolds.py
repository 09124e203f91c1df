"""Drag against the local Reynolds number, smooth and rough, through the drag crisis.

    g = C_D(Re) / C_D(1e5),    Re = |w| D / nu,    linear in log Re between the entries

Smooth: Wieselsberger's data as tabulated in a public wind-engineering text [READ] up to 8e5; beyond, DNV-RP-C205 as coded in
MSS cylinderDrag.m [READ]. The two disagree where the flow is critical (0.31 against 0.47 at 5e5): do not extrapolate C_D across the
crisis. Between 2e5 and 5e5 the drag of one arm may differ from any table, with roughness and free-stream turbulence.
Rough (k/D = 1e-2): minimum 0.8 at 5e4 to 6e4, 1.02 at 2e5, 1.08 above 8e5, dtocean-core test data [READ]; joined to the smooth table
below 1.5e4, that join is ours.
No dependence of C_M is known to us: its factor is 1.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.coefficients.law import Law, StripState
from nnhydro.physics.coefficients.table import interpolate_log

REFERENCE = 1e5
SUBCRITICAL = ((1e2, 1.4), (2e2, 1.27), (9e2, 0.96), (2.3e3, 0.89), (5e3, 0.94), (1.5e4, 1.14))
SMOOTH = (*SUBCRITICAL, (1e5, 1.17), (1.8e5, 1.16), (2.2e5, 1.06), (2.9e5, 0.92), (3.65e5, 0.73), (4.3e5, 0.54), (5e5, 0.31),
          (5.6e5, 0.31), (8e5, 0.355), (1e6, 0.37), (2e6, 0.56), (3e6, 0.63), (5e6, 0.68))
ROUGH = (*SUBCRITICAL, (5e4, 0.8), (6e4, 0.8), (2e5, 1.02), (8e5, 1.08))


def drag_coefficient(Re: Tensor, rough: bool = False) -> Tensor:
    """Return C_D(Re) of a long cylinder, reference area L D, for Reynolds numbers of any shape; constant below 100."""
    at, values = zip(*(ROUGH if rough else SMOOTH), strict=True)
    return interpolate_log(Re, at, values)


@final
@dataclass(frozen=True)
class SmoothReynolds(Law):
    """C_D(Re) of a smooth cylinder, relative to Re = 1e5."""

    kind: ClassVar[str] = "reynolds_smooth"

    def drag(self, state: StripState) -> Tensor:
        """Return C_D(Re) / C_D(1e5), (n, links, s)."""
        return drag_coefficient(state.Re) / drag_coefficient(torch.tensor(REFERENCE, dtype=torch.float64))

    def added_mass(self, state: StripState) -> Tensor:
        """Return 1."""
        return torch.ones_like(state.Re)


@final
@dataclass(frozen=True)
class RoughReynolds(Law):
    """C_D(Re) of a rough cylinder (k/D = 1e-2), relative to Re = 1e5."""

    kind: ClassVar[str] = "reynolds_rough"

    def drag(self, state: StripState) -> Tensor:
        """Return C_D(Re) / C_D(1e5), (n, links, s)."""
        return drag_coefficient(state.Re, True) / drag_coefficient(torch.tensor(REFERENCE, dtype=torch.float64), True)

    def added_mass(self, state: StripState) -> Tensor:
        """Return 1."""
        return torch.ones_like(state.Re)
