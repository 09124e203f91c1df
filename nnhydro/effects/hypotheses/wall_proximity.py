"""Hypothesis: a wall or the floor is near."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow, sum_over_links
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.term import unit_drag, unit_inertia

STRIPS = 20  # a link
TURN = tuple(k * pi / 4 for k in range(-3, 5))


@effect
@final
@dataclass(frozen=True)
class WallProximity(LoadEffect):
    """Drag and added mass grow where strips come near a wall; direction and reach of the wall's influence are searched."""

    id = "wall_proximity"
    family = "interference"
    name = "nearness of a wall"
    mechanism = "Between link and wall, the water must flow faster: drag and added mass rise when the arm points at the wall."
    equation = "C -> C + a p,  p = exp(-(1 - r.d / R) / depth),  r the place of the strip, d the direction of the wall, R the arm's reach"
    source = ("added mass near a wall: Wave Forces on Cylinders near Plane Boundary, abstract at "
              "https://paperexplained.cn/articles/paper/detail/840a402b330adf33aea566bc5f5818a81ea9a005; drag between near side walls "
              "(at low Reynolds numbers): https://discovery.researcher.life/topic/circular-cylinders-of-finite-length/24862400?page=4; "
              "the form is ours")
    signature = Signature(
        depends_on=("q", "w", "dw"), parity="mixed", region="postures that point in one direction of the tank",
        excited_by="the same motion around several directions of joint 1",
        mistaken_for=("link_interference", "tip_drag", "ambient_current", "drag_form"),
    )
    acts = "arm"
    needs_water = True

    drag: Values = parameter("1", 0.0, (0.0, 10.0), "rise of C_D at full reach towards the wall", per="arm")
    inertia: Values = parameter("1", 0.0, (0.0, 10.0), "rise of C_M at full reach towards the wall", per="arm")
    direction: Values = parameter("rad", 0.0, (-2 * pi, 2 * pi), "direction of the wall from the hub, from +X", per="arm",
                                  linear=False, grid=TURN)
    depth: Values = parameter("1", 0.3, (0.02, 5.0), "distance over which the influence fades, in reaches of the arm", per="arm",
                              linear=False, grid=(0.1, 0.3, 0.8))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (drag, inertia), (n, joints, 2)."""
        strips = Strips.of(flow, STRIPS)
        towards = torch.cos(flow.phi - self.direction[0])  # of each link, per metre along it
        step = flow.L * towards
        place = (step.cumsum(1) - step)[..., None] + strips.x * towards[..., None]
        near = torch.exp((place / flow.L.sum() - 1) / self.depth[0])
        return torch.stack([sum_over_links(strips.to_joints(f * near)) for f in (unit_drag(strips), unit_inertia(strips))], dim=-1)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"A wall is near, in the direction {text['direction']} from +X. At full reach towards it, C_D rises by {text['drag']} and "
                f"C_M by {text['inertia']}.")
