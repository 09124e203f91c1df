"""Hypothesis: the drag coefficient depends on the Reynolds number."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.term import strip_columns, unit_drag

REFERENCE = 3e4  # Re of a link of 6 cm at 0.5 m/s
LOWEST = 1e2  # below, the load is too small to matter
STRIPS = 20  # a link


@effect
@final
@dataclass(frozen=True)
class ReynoldsDrag(LoadEffect):
    """C_D of every strip is a parabola in log10 of its own Reynolds number, or a cubic, which levels off on both sides."""

    id = "reynolds_drag"
    family = "drag_law"
    name = "drag that depends on the Reynolds number"
    mechanism = "Where the flow separates from the link depends on speed times size over viscosity; near the drag crisis C_D falls steeply."
    equation = "C_D -> C_D + a r + b r^2 + c r^3,  c = 0 in a parabola,  r = log10(Re / 3e4),  Re = |w| D / nu of each strip"
    source = "Wieselsberger's curve C_D(Re), as used in the package's table; parabola and cubic are ours"
    signature = Signature(
        depends_on=("w",), parity="odd", region="drag that grows with another power of speed than 2, at the fast tip first",
        excited_by="the same posture towed at many speeds", mistaken_for=("drag_form", "viscous_friction", "tip_drag", "flow_memory"),
    )
    acts = "arm"
    needs_water = True

    slope: Values = parameter("1", 0.0, (-3.0, 3.0), "change of C_D per factor of ten in Re", per="arm")
    bend: Values = parameter("1", 0.0, (-3.0, 3.0), "curvature of C_D over log10 Re", per="arm")
    turn: Values = parameter("1", 0.0, (-10.0, 10.0), "change of the curvature: a crisis has two bends", per="arm", absent=True)

    def narrower(self) -> tuple["ReynoldsDrag", ...]:
        """Return the parabola alone."""
        return (replace(self, turn=()),)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (slope, bend, turn), (n, joints, 3), or of the first two alone."""
        strips = Strips.of(flow, STRIPS)
        Re = strips.w.abs() * flow.D[:, None] / flow.nu
        r = torch.log10(Re.clamp(min=LOWEST) / REFERENCE)
        return strip_columns(strips, unit_drag(strips), torch.stack([r**k for k in range(1, 3 + len(self.turn))], dim=-1)).sum(2)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        turns = f", turn {text['turn']}" if "turn" in text else ""
        return f"C_D changes by {text['slope']} per decade of the Reynolds number at 3e4 (bend {text['bend']}{turns})."
