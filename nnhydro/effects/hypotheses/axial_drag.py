"""Hypothesis: the water drags along the links, not only across."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.axial_drag import AxialDrag


@effect
@final
@dataclass(frozen=True)
class AxialDragEffect(LoadEffect):
    """Skin friction along every link with one coefficient; felt by the joints inboard of a link only."""

    id = "axial_drag"
    family = "drag_law"
    cause = "axial_drag"
    name = "drag along the links"
    mechanism = "Water that slides along a link rubs on its skin and pushes on its blunt end. The inboard joints must resist both."
    equation = "f_x,i = 1/2 rho D_i L_i C_Dx |u_x,i| u_x,i, along link i"
    source = "Rivera (1995), eqs. 3-1-27 to 3-1-29"
    signature = Signature(
        depends_on=("q", "qd", "u0"), parity="odd", region="a bent arm whose outer link moves lengthwise",
        excited_by="towing or turning with the outer link across the inner one",
        mistaken_for=("tip_drag", "link_interference", "wall_proximity"),
    )
    acts = "arm"
    needs_water = True
    fewest_links = 2
    dissipates = True

    C_Dx: Values = parameter("1", 0.05, (0.0, 2.0), "axial drag coefficient, reference area L D", per="arm")

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d C_Dx, (n, joints, 1)."""
        return AxialDrag(self.C_Dx).columns(flow).sum(-1, keepdim=True)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"Axial drag acts along the links: C_Dx = {text['C_Dx']} (reference area L D)."
