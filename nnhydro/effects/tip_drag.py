"""Hypothesis: something at the tip drags through the water."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow


@effect
@final
@dataclass(frozen=True)
class TipDrag(LoadEffect):
    """A body at the end of the last link whose drag points against its velocity."""

    id = "tip_drag"
    family = "drag_law"
    name = "drag of a body at the tip"
    mechanism = "A gripper, a bracket or a loose line at the tip holds back the arm where its lever is longest."
    equation = "F = 1/2 rho (C_D S) |v_tip| v_tip,  tau = J_tip^T F"
    source = "drag of a bluff body, alike in all directions: from general knowledge, not checked"
    signature = Signature(
        depends_on=("q", "qd", "u0"), parity="odd", region="fast motion of the tip, lengthwise too",
        excited_by="turning the outer joint alone, and towing with the outer link lengthwise",
        mistaken_for=("axial_drag", "drag_form", "reynolds_drag", "wall_proximity"),
    )
    acts = "arm"
    needs_water = True
    dissipates = True

    drag_area: Values = parameter("m^2", 0.002, (0.0, 10.0), "drag coefficient times frontal area", per="arm")

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d drag_area, (n, joints, 1)."""
        L = flow.L[-1]
        across, along = flow.A[:, -1] * L + flow.B[:, -1], flow.u_x[:, -1]
        pressure = 0.5 * flow.rho * torch.hypot(across, along)
        normal, axial = torch.zeros_like(flow.A), torch.zeros_like(flow.A)
        normal[:, -1], axial[:, -1] = pressure * across, pressure * along
        return (flow.normal_columns(normal, normal * L) + flow.axial_columns(axial))[..., -1:]

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"Something at the tip drags through the water with C_D times area of {said['drag_area']}."
