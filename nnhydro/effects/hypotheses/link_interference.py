"""Hypothesis: one link lies in the other's wake."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.term import strip_columns, unit_drag

STRIPS = 20  # a link
PARALLEL = 1e-3  # sine between way and neighbour below which they do not meet
TINY = 1e-12  # m/s
ALIGNED = 0.2  # sine of the bend over which the side changes


def shadow(flow: Flow, strips: Strips, link: int, reach: float) -> Tensor:
    """Return l/(l + r/D) (n, s) of the strips of `link` (from 0) whose way through the water leads to the neighbour in r, else 0.

    In the frame of the link a strip at (x, 0) moves along (u, w); the neighbour is the stretch from the joint between them along d.
    """
    other = link - 1 if link else 1
    bend, L, D = flow.motion.q[:, max(link, 1), None], flow.L[other], flow.D[other]
    along, across = flow.u_x[:, link, None].expand_as(strips.w[:, link]), strips.w[:, link]
    d = (-torch.cos(bend), torch.sin(bend)) if link else (torch.cos(bend), torch.sin(bend))
    to_joint = (0.0 if link else flow.L[0]) - strips.x[link]  # (s,), along the link
    turned = along * d[1] - across * d[0]
    speed = torch.hypot(along, across)
    turned = torch.where(turned.abs() < PARALLEL * speed + TINY, torch.full_like(turned, float("inf")), turned)
    way, place = speed * to_joint * d[1] / turned, to_joint * across / turned
    inside = torch.sigmoid(4 * place / D) * torch.sigmoid(4 * (L - place) / D)
    return torch.where((way > 0) & turned.isfinite(), inside / (1 + way / (reach * D)), torch.zeros_like(way))


@effect
@final
@dataclass(frozen=True)
class LinkInterference(LoadEffect):
    """Drag of one link changes with how far the arm is folded, and with whether the neighbour lies ahead or behind."""

    id = "link_interference"
    family = "interference"
    name = "one link in the other's wake"
    mechanism = "Folded back, a link runs through water that its neighbour has already set in motion, so that its drag falls or rises."
    equation = ("C_D,i -> C_D,i + (a + b sgn(w) sgn(sin q)) ((1 - cos q)/2)^p + c l/(l + r/D) where the neighbour lies r ahead of a strip, "
                "q the angle between the two links")
    source = "Rivera (1995), sections 2 and 3.1: the planar angle acts on the coefficients; the forms are ours"
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
    shadow: Values = parameter("1", 0.0, (-3.0, 3.0), "change c of C_D of a strip that runs into the neighbour's wake", per="arm")
    power: Values = parameter("1", 2.0, (0.5, 12.0), "how sharply the change sets in with folding", per="arm", linear=False,
                              grid=(0.5, 2.0, 8.0))
    reach: Values = parameter("1", 10.0, (0.5, 200.0), "diameters l over which the wake recovers by half", per="arm", linear=False,
                              grid=(3.0, 10.0, 40.0))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (shelter, side, shadow), (n, joints, 3)."""
        folded = flow.memo.of((type(self), self.joint, "power", *self.power), lambda: self._folding_columns(flow))
        return torch.cat([folded, flow.memo.of((type(self), self.joint, "reach", *self.reach), lambda: self._shadow_columns(flow))], dim=-1)

    def _folding_columns(self, flow: Flow) -> Tensor:
        """d tau / d (shelter, side), (n, joints, 2)."""
        link, strips = self.joint - 1, Strips.of(flow, STRIPS)
        bend = flow.motion.q[:, max(link, 1)]
        ahead = torch.sin(bend) if link else -torch.sin(bend)  # the neighbour lies on the side of +n
        folded = ((1 - torch.cos(bend)) / 2) ** self.power[0]
        side = torch.sign(strips.w[:, link]) * torch.tanh(ahead / ALIGNED)[:, None]
        return self._columns(strips, torch.stack([folded[:, None].expand_as(side), folded[:, None] * side], dim=-1))

    def _shadow_columns(self, flow: Flow) -> Tensor:
        """d tau / d shadow, (n, joints, 1)."""
        strips = Strips.of(flow, STRIPS)
        return self._columns(strips, shadow(flow, strips, self.joint - 1, self.reach[0])[..., None])

    def _columns(self, strips: Strips, share: Tensor) -> Tensor:
        """The joint torques (n, joints, p) of the link's drag times `share` (n, s, p)."""
        shares = torch.zeros(*strips.w.shape, share.shape[-1], dtype=torch.float64)
        shares[:, self.joint - 1] = share
        return strip_columns(strips, unit_drag(strips), shares).sum(2)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        other = self.joint - 1 if self.joint > 1 else 2
        return (f"Link {self.joint} runs into the wake of link {other}: there, its C_D changes by {text['shadow']}. When the arm is "
                f"folded, its C_D changes by a further {text['shelter']}. While link {self.joint} moves towards link {other}, "
                f"{text['side']} is added to this change; while it moves away, it is subtracted.")
