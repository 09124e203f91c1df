"""Hypothesis: something at the tip drags through the water."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import ANY_SIZE, LoadEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.flow import Flow

WATER = 1000.0  # kg/m^3: which water it is matters little to a power
REFERENCE = 0.5  # m/s: the speed at which the power of the speed is taken
LEAST_POWER = 1.5  # of the speed: what grows more slowly is no drag of a body in water


@effect
@final
@dataclass(frozen=True)
class TipDrag(LoadEffect):
    """A body at the end of the last link whose drag points against its velocity; some grow more slowly than with the speed's square."""

    id = "tip_drag"
    family = "drag_law"
    cause = "tip_body"
    name = "drag of a body at the tip"
    mechanism = "A gripper, a bracket or a loose line at the tip resists the motion of the arm where its lever is longest."
    equation = "F = (1/2 rho C_D S |v_tip| + b) v_tip,  tau = J_tip^T F,  b = 0 where it is a bluff body"
    source = ("linear and quadratic drag after Fossen: Gazebo Sim, Hydrodynamics, "
              "https://gazebosim.org/api/sim/9/classgz_1_1sim_1_1systems_1_1Hydrodynamics.html; alike in all directions is ours")
    signature = Signature(
        depends_on=("qd", "q", "u0"), parity="odd", region="fast motion of the tip, lengthwise too",
        excited_by="turning the outer joint alone, and towing with the outer link lengthwise",
        mistaken_for=("axial_drag", "drag_form", "reynolds_drag", "wall_proximity"),
    )
    acts = "arm"
    needs_water = True
    dissipates = True

    drag_area: Values = parameter("m^2", 0.002, (0.0, 10.0), "drag coefficient times frontal area", per="arm")
    linear: Values = parameter("N s/m", 0.1, ANY_SIZE, "part of the drag proportional to speed, b", per="arm", absent=True)

    def narrower(self) -> tuple["TipDrag", ...]:
        """Return the bluff body alone."""
        return (replace(self, linear=()),)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (drag_area, linear), (n, joints, 2), or of the first alone."""
        across, along = flow.A[:, -1] * flow.L[-1] + flow.B[:, -1], flow.u_x[:, -1]
        pressure = 0.5 * flow.rho * torch.hypot(across, along)
        shapes = [pressure, *[torch.ones_like(pressure)] * len(self.linear)]
        return torch.cat([self._pull(flow, shape * across, shape * along) for shape in shapes], dim=-1)

    @staticmethod
    def _pull(flow: Flow, across: Tensor, along: Tensor) -> Tensor:
        """Joint torques (n, joints, 1) N m of a force at the tip, N, across and along the last link."""
        normal, axial = torch.zeros_like(flow.A), torch.zeros_like(flow.A)
        normal[:, -1], axial[:, -1] = across, along
        return (flow.normal_columns(normal, normal * flow.L[-1]) + flow.axial_columns(axial))[..., -1:]

    def _power(self) -> float:
        """The power of the speed with which the drag grows at 0.5 m/s, d ln F / d ln v; 2 for a bluff body."""
        quadratic, linear = 0.5 * WATER * self.drag_area[0] * REFERENCE, sum(self.linear)
        return 1.0 + quadratic / (quadratic + linear) if linear else 2.0

    def plausible(self) -> bool:
        """Return whether the drag grows with a power of the speed that a body can have."""
        return self._power() >= LEAST_POWER

    def quantities(self) -> dict[str, Quantity]:
        """Return the drag area, and the linear part where there is one."""
        return {"drag_area": Quantity(self.drag_area[0], "m^2")} | ({"linear": Quantity(self.linear[0], "N s/m")} if self.linear else {})

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        grows = f", plus a linear part of {text['linear']}" if "linear" in text else ""
        return f"A body at the tip adds drag: C_D times area is {text['drag_area']}{grows}."
