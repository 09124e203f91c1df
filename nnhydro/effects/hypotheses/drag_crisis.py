"""Hypothesis: the links pass the drag crisis."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.term import unit_drag

STRIPS = 20  # a link
SLOWEST = 1e-6  # of the Reynolds number of the crisis: below, nothing is left of it


@effect
@final
@dataclass(frozen=True)
class DragCrisis(LoadEffect):
    """C_D of every strip falls by a step where its own Reynolds number passes a critical value."""

    id = "drag_crisis"
    family = "drag_law"
    name = "drag crisis"
    mechanism = ("Above a critical Reynolds number the boundary layer turns turbulent, the wake narrows, and C_D falls to a half or a "
                 "quarter.")
    equation = "C_D -> C_D - drop (1 + tanh((log10 Re - log10 Re_c)/width))/2,   Re = |w| D / nu of each strip"
    source = ("Achenbach (1968), J. Fluid Mech. 34, 625, from general knowledge: C_D falls at Re = 2e5 to 4e5, earlier on rough cylinders; "
              "the tanh is ours")
    signature = Signature(
        depends_on=("w",), parity="odd", region="speeds beyond which the drag grows more slowly, or falls; at the fast tip first",
        excited_by="towing at many speeds, well below and above the crisis",
        mistaken_for=("reynolds_drag", "drag_form", "tip_drag", "flow_memory"),
    )
    acts = "arm"
    needs_water = True

    drop: Values = parameter("1", 0.5, (0.0, 2.0), "how far C_D falls", per="arm")
    critical: Values = parameter("1", 2e5, (1e4, 2e6), "Reynolds number Re_c in the middle of the fall", per="arm", linear=False,
                                 grid=(5e4, 1e5, 2e5, 4e5))
    width: Values = parameter("1", 0.1, (0.02, 0.5), "decades of Re from the middle to where an eighth of the fall is left", per="arm",
                              linear=False, grid=(0.07, 0.2))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d drop, (n, joints, 1)."""
        strips = Strips.of(flow, STRIPS)
        Re = strips.w.abs() * flow.D[:, None] / flow.nu
        decades = torch.log10((Re / self.critical[0]).clamp(min=SLOWEST))
        fallen = (1 + torch.tanh(decades / self.width[0])) / 2
        return -strips.to_joints(unit_drag(strips) * fallen).sum(-1, keepdim=True)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"The links pass the drag crisis: C_D falls by {text['drop']} about the Reynolds number {text['critical']}, within "
                f"{text['width']} decades to either side.")
