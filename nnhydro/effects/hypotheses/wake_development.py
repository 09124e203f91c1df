"""Hypothesis: drag and added mass depend on how far each strip has moved since it started."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.coefficients.travel_bspline import shapes
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.term import strip_columns, travel_of, unit_drag, unit_inertia
from nnhydro.physics.travel.travel import TravelRule

STRIPS = 10  # a link
CURVES = 3  # shapes a coefficient: B-splines that vanish where the wake is developed


@effect
@final
@dataclass(frozen=True)
class WakeDevelopment(LoadEffect):
    """Changes of C_D and C_M over the travel of each strip since its start or last reversal, nothing beyond `reach` diameters."""

    id = "wake_development"
    family = "wake"
    name = "wake that has yet to develop"
    mechanism = "A link that starts has no wake yet. Over a few diameters of travel, drag builds up and settles, and added mass falls."
    equation = "C_D -> C_D + sum_k d_k b_k(s / (reach D)),  C_M -> C_M + sum_k m_k b_k,  b_k = 0 for s > reach D"
    source = "McLain & Rock (1998), eqs. (1), (25) to (27): coefficients are functions of s/D; the B-splines are ours"
    signature = Signature(
        depends_on=("s/D", "w", "dw"), parity="odd", region="the first diameters after each start and reversal",
        excited_by="starts from rest at several accelerations, and strokes long and short",
        mistaken_for=("flow_memory", "wake_reentry", "history_force", "added_mass"),
    )
    acts = "arm"
    needs_water = True

    d0: Values = parameter("1", 0.0, (-3.0, 3.0), "change of C_D at the start", per="arm")
    d1: Values = parameter("1", 0.0, (-3.0, 3.0), "change of C_D early on", per="arm")
    d2: Values = parameter("1", 0.0, (-3.0, 3.0), "change of C_D half-way", per="arm")
    m0: Values = parameter("1", 0.0, (-3.0, 3.0), "change of C_M at the start", per="arm")
    m1: Values = parameter("1", 0.0, (-3.0, 3.0), "change of C_M early on", per="arm")
    m2: Values = parameter("1", 0.0, (-3.0, 3.0), "change of C_M half-way", per="arm")
    reach: Values = parameter("1", 8.0, (1.0, 60.0), "travel in diameters after which the wake is developed", per="arm", linear=False,
                              grid=(4.0, 8.0, 14.0, 25.0))

    def shapes(self, s_over_D: Tensor) -> Tensor:
        """Return b_k (..., 3) at the travel `s_over_D` (...)."""
        return shapes(s_over_D, self.reach[0], CURVES)[..., :-1]

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (d0, d1, d2, m0, m1, m2), (n, joints, 6)."""
        strips = Strips.of(flow, STRIPS)
        b = self.shapes(travel_of(strips, TravelRule()))
        return torch.cat([strip_columns(strips, f, b).sum(2) for f in (unit_drag(strips), unit_inertia(strips))], dim=-1)

    def quantities(self) -> dict[str, Quantity]:
        """Return what C_D and C_M exceed the developed ones by at the start and a quarter of the reach, their change between, the reach."""
        quarter = self.shapes(torch.tensor([self.reach[0] / 4], dtype=torch.float64))[0]
        d, m = ((self.linear_values()[k:k + 3] * quarter).sum() for k in (0, 3))
        return {"C_D_change_at_start": Quantity(self.d0[0], "1"), "C_M_change_at_start": Quantity(self.m0[0], "1"),
                "C_D_change_early": Quantity(float(d), "1"), "C_M_change_early": Quantity(float(m), "1"),
                "C_D_change": Quantity(float(d) - self.d0[0], "1"), "C_M_change": Quantity(float(m) - self.m0[0], "1"),
                "reach": Quantity(self.reach[0], "1")}

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"The wake develops over {text['reach']} diameters of travel. In the first quarter of this travel, C_D changes by "
                f"{text['C_D_change']}, and C_M by {text['C_M_change']}.")
