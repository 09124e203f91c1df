"""Coefficients of a cylinder of finite length against its slenderness L/D.

    g_D = C_D(L/D) / C_D(inf),   g_M = C_M(L/D) / C_M(inf),   linear in log L/D between the entries

C_D, two free ends, subcritical, reference area L D: Wieselsberger 1922 / Goettingen as tabulated in a public wind-engineering text [READ].
C_D rises with L/D and reaches the value of an infinite cylinder only beyond the slenderness of manipulators (McLain & Rock 1998,
figure 13 [M]; Zdravkovich as quoted by Rivera 1995 [R]).
C_M: DNV-RP-C205 for motion across the axis, attached flow, KC <= 8 [MEM: from memory, not found as numbers in a source at hand].
A link of an arm has one free end: its own neighbour closes the other, and the truth lies between g and 1.
"""

from dataclasses import dataclass
from math import inf
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.coefficients.law import Law, StripState
from nnhydro.physics.coefficients.table import interpolate_log

INFINITE = 1e3  # L/D at which a cylinder counts as infinite: ours, the tables end at 42 and 9 and then say "infinite"
C_D = ((1.0, 0.61), (2.0, 0.69), (2.9, 0.74), (5.0, 0.74), (10.0, 0.82), (20.0, 0.93), (42.0, 0.99), (INFINITE, 1.19))
C_M = ((1.2, 0.62), (2.5, 0.78), (5.0, 0.90), (9.0, 0.96), (INFINITE, 1.00))


def drag_coefficient(slenderness: Tensor) -> Tensor:
    """Return C_D(L/D) of a cylinder with two free ends."""
    at, values = zip(*C_D, strict=True)
    return interpolate_log(slenderness, at, values)


def added_mass_coefficient(slenderness: Tensor) -> Tensor:
    """Return C_M(L/D) in attached flow (ideal 1)."""
    at, values = zip(*C_M, strict=True)
    return interpolate_log(slenderness, at, values)


@final
@dataclass(frozen=True)
class AspectRatio(Law):
    """Drag and added mass of a finite cylinder relative to an infinite one."""

    kind: ClassVar[str] = "aspect_ratio"

    def drag(self, state: StripState) -> Tensor:
        """Return C_D(L/D) / C_D(inf), (links, 1)."""
        return drag_coefficient(state.L_over_D) / drag_coefficient(torch.tensor(inf, dtype=torch.float64))

    def added_mass(self, state: StripState) -> Tensor:
        """Return C_M(L/D) / C_M(inf), (links, 1)."""
        return added_mass_coefficient(state.L_over_D) / added_mass_coefficient(torch.tensor(inf, dtype=torch.float64))
