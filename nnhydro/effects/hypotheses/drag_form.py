"""Hypothesis: the drag law has another form with speed or along the span than the baseline's."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import ANY_VALUE, LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.term import unit_drag

STRIPS = 20  # a link


@effect
@final
@dataclass(frozen=True)
class DragForm(LoadEffect):
    """What a law of drag can differ in: parts linear and cubic in speed, a taper along each link, its ends, and the two directions."""

    id = "drag_form"
    family = "drag_law"
    name = "other form of the drag law"
    mechanism = ("The baseline's drag is quadratic in speed, the same in both directions and uniform along the link. Slow or streamlined "
                 "flow has another law, and so has a link that is tapered or not alike fore and aft, or a propeller.")
    equation = "f = 1/2 rho D (c_1 w + c_3 |w|^2 w + (k_i s + e_i (3 s^2 - 1)/2) |w| w + d_i w^2),  s = 2 x/L - 1"
    source = "first terms of an expansion in speed, direction and span: ours; relief near free ends: Rivera (1995), section 2"
    signature = Signature(
        depends_on=("w", "x"), parity="mixed", region="slow or very fast flow, one direction, or the tip against the root of a link",
        excited_by="the same posture towed at many speeds, both ways; turning against towing",
        mistaken_for=("reynolds_drag", "viscous_friction", "tip_drag", "wall_proximity"),
    )
    acts = "arm"
    general = True
    needs_water = True

    linear: Values = parameter("m/s", 0.0, ANY_VALUE, "coefficient c_1 of the part linear in speed", per="arm")
    cubic: Values = parameter("s/m", 0.0, ANY_VALUE, "coefficient c_3 of the part cubic in speed", per="arm")
    taper: Values = parameter("1", 0.0, (-6.0, 6.0), "C_D at the outer end less its mean along the link")
    ends: Values = parameter("1", 0.0, (-6.0, 6.0), "C_D at both ends less its mean along the link")
    direction: Values = parameter("1", 0.0, (-6.0, 6.0), "C_D forwards (to larger angles) less the mean of both directions", absent=True)

    def narrower(self) -> tuple["DragForm", ...]:
        """Return the symmetric law, those of the span, taper, speed and direction: needless free parameters mislead at other speeds."""
        symmetric = replace(self, direction=())
        span, speed = replace(symmetric, linear=(), cubic=()), replace(self, taper=(), ends=())
        return symmetric, span, replace(span, ends=()), speed, replace(speed, direction=()), replace(speed, linear=(), cubic=())

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (linear, cubic, taper, ends, direction), (n, joints, 2 + 3 links), less what this law leaves out."""
        strips = Strips.of(flow, STRIPS)
        w, drag = strips.w, unit_drag(strips)
        pressure = 0.5 * flow.rho * flow.D[:, None]
        span = 2 * strips.x / flow.L[:, None] - 1
        parts = ((self.linear, strips.to_joints(pressure * w).sum(-1, keepdim=True)),
                 (self.cubic, strips.to_joints(drag * w.abs()).sum(-1, keepdim=True)),
                 (self.taper, strips.to_joints(drag * span)), (self.ends, strips.to_joints(drag * (3 * span**2 - 1) / 2)),
                 (self.direction, strips.to_joints(pressure * w**2)))
        return torch.cat([columns for values, columns in parts if values], dim=-1)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        differences = [what for values, what in ((self.linear, "not quadratic in speed"), (self.direction, "not alike in both directions"),
                                                 (self.taper, "not uniform along the link")) if values]
        return f"Drag is {', or '.join(differences)}: {', '.join(f'{name} {value}' for name, value in text.items())}."
