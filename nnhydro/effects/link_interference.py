"""Hypothesis: one link lies in the other's wake."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel_term import strip_columns, unit_drag

STRIPS = 20  # a link
ALIGNED = 0.2  # sine of the bend over which the side changes


@effect
@final
@dataclass(frozen=True)
class LinkInterference(LoadEffect):
    """Drag of one link changes with how far the arm is folded, and with whether the neighbour lies ahead or behind."""

    id = "link_interference"
    family = "interference"
    name = "one link in the other's wake"
    mechanism = "Folded back, a link runs through water that its neighbour has already set in motion, and feels less of it, or more."
    equation = "C_D,i -> C_D,i + (a + b sgn(w) sgn(sin q)) ((1 - cos q)/2)^p,  q the angle between the two links"
    source = "Rivera (1995), sections 2 and 3.1: the planar angle acts on the coefficients; the form is ours"
    signature = Signature(
        depends_on=("q", "w"), parity="odd", region="folded postures, one direction of motion more than the other",
        excited_by="towing and turning at many angles between the links, folded ones among them",
        mistaken_for=("reynolds_drag", "wall_proximity", "wake_reentry", "drag_form"),
    )
    acts = "link"
    needs_water = True
    fewest_links = 2

    shelter: Values = parameter("1", 0.0, (-3.0, 3.0), "change a of C_D when folded, either way", per="arm")
    side: Values = parameter("1", 0.0, (-3.0, 3.0), "change b that has the other sign when the neighbour lies behind", per="arm")
    power: Values = parameter("1", 2.0, (0.5, 12.0), "how sharply the change sets in with folding", per="arm", linear=False,
                              grid=(0.5, 1.0, 2.0, 4.0, 8.0))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (shelter, side), (n, joints, 2)."""
        link = self.joint - 1
        bend = flow.motion.q[:, max(link, 1)]
        ahead = torch.sin(bend) if link else -torch.sin(bend)  # the neighbour lies on the side of +n
        strips = Strips.of(flow, STRIPS)
        folded = ((1 - torch.cos(bend)) / 2) ** self.power[0]
        side = torch.sign(strips.w[:, link]) * torch.tanh(ahead / ALIGNED)[:, None]
        shares = torch.zeros(*strips.w.shape, 2, dtype=torch.float64)
        shares[:, link, :, 0], shares[:, link, :, 1] = folded[:, None], folded[:, None] * side
        return strip_columns(strips, unit_drag(strips), shares).sum(2)

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"Folded back, C_D of link {self.joint} changes by {said['shelter']}, and by a further {said['side']} with the neighbour "
                "ahead (as much the other way with it behind): it lies in the other link's wake.")
