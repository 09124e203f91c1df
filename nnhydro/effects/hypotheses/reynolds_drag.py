"""Hypothesis: the drag coefficient depends on the Reynolds number."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.errors import ModelError, require
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.term import strip_columns, unit_drag
from nnhydro.recordings.arm import Arm

LOWEST, HIGHEST = 1e2, 9e6  # the Reynolds numbers of tow tanks; their mean, 3e4, is that of a link of 6 cm at 0.5 m/s
STRIPS = 20  # a link
MOST = 3.0  # change of C_D within a third of a decade, which bounds the coefficients


@effect
@final
@dataclass(frozen=True)
class ReynoldsDrag(LoadEffect):
    """C_D of every strip is a parabola in log10 of its own Reynolds number, or a cubic, or falls by a step: the drag crisis."""

    id = "reynolds_drag"
    family = "drag_law"
    name = "drag that depends on the Reynolds number"
    mechanism = "Where the flow separates from the link depends on speed times size over viscosity; in the drag crisis C_D falls steeply."
    equation = ("C_D -> C_D + a r + b r^2 + c r^3 - d (1 + tanh((r - r_c)/width))/2,  c = d = 0 in a parabola, d = 0 in a cubic, "
                "a = b = c = 0 in a crisis,  r = log10(Re / Re_0),  Re = |w| D / nu of each strip,  Re_0 the campaign's mean")
    source = ("Wieselsberger's curve C_D(Re), as used in the package's table; crisis at Re = 2e5 to 4e5, earlier on rough cylinders: "
              "Achenbach (1968), J. Fluid Mech. 34, 625, from general knowledge; parabola, cubic and tanh are ours")
    signature = Signature(
        depends_on=("w",), parity="odd", region="drag that grows with another power of speed than 2, at the fast tip first",
        excited_by="the same posture towed at many speeds", mistaken_for=("drag_form", "viscous_friction", "tip_drag", "flow_memory"),
    )
    acts = "arm"
    needs_water = True

    slope: Values = parameter("1", 0.0, (-3 * MOST, 3 * MOST), "change of C_D per factor of ten in Re", per="arm")
    bend: Values = parameter("1", 0.0, (-9 * MOST, 9 * MOST), "curvature of C_D over log10 Re", per="arm")
    turn: Values = parameter("1", 0.0, (-27 * MOST, 27 * MOST), "change of the curvature", per="arm", absent=True)
    drop: Values = parameter("1", 0.5, (0.0, 2.0), "fall of C_D in the drag crisis", per="arm", absent=True)
    critical: Values = parameter("1", 2e5, (1e4, 2e6), "Reynolds number in the middle of its fall", per="arm", linear=False,
                                 grid=(5e4, 1e5, 2e5, 4e5), absent=True)
    width: Values = parameter("1", 0.1, (0.02, 0.5), "decades of Re from the middle to where an eighth of the fall is left", per="arm",
                              linear=False, grid=(0.07, 0.2), absent=True)
    lowest: float = LOWEST  # Reynolds numbers beyond which C_D is constant: those of the campaign
    highest: float = HIGHEST

    def __post_init__(self) -> None:
        super().__post_init__()
        require(0 < self.lowest <= self.highest,
                f"reynolds_drag: Reynolds numbers from {self.lowest:g} to {self.highest:g}: lowest > 0, highest not below it", ModelError)

    @classmethod
    def at_start(cls, arm: Arm, **options: Any) -> "ReynoldsDrag":
        """Return the cubic."""
        return replace(super().at_start(arm, **options), drop=(), critical=(), width=())

    def at_reynolds(self, low: float, high: float) -> "ReynoldsDrag":
        """Return the law about the mean of these Reynolds numbers: about another, its values would be known badly, and all together."""
        return replace(self, lowest=low, highest=high)

    def _reference(self) -> float:
        """Re_0, the geometric mean of the lowest and the highest Reynolds number."""
        return float((self.lowest * self.highest) ** 0.5)

    def narrower(self) -> tuple["ReynoldsDrag", ...]:
        """Return the parabola alone, and the crisis alone."""
        start: dict[str, Any] = {field.name: (field.metadata["start"],) for field in self.parameters()
                                 if field.name in ("drop", "critical", "width")}
        return replace(self, turn=()), replace(self, slope=(), bend=(), turn=(), **start)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (slope, bend, turn, drop), (n, joints, 4), less what this law leaves out."""
        strips = Strips.of(flow, STRIPS)
        Re = strips.w.abs() * flow.D[:, None] / flow.nu
        r = torch.log10(Re.clamp(self.lowest, self.highest) / self._reference())
        shapes = [r**k for k in range(1, 1 + len(self.slope + self.bend + self.turn))]
        if self.drop:
            shapes.append(-(1 + torch.tanh(torch.log10(Re.clamp(min=LOWEST) / self.critical[0]) / self.width[0])) / 2)
        return strip_columns(strips, unit_drag(strips), torch.stack(shapes, dim=-1)).sum(2)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        if self.drop:
            return (f"C_D falls by {text['drop']} at a Reynolds number of {text['critical']} (drag crisis). The fall extends over "
                    f"{text['width']} decades to either side.")
        turns = f", {text['turn']} per decade cubed" if "turn" in text else ""
        middle = float(f"{self._reference():.2g}")
        return (f"C_D depends on the Reynolds number: about {middle:g} it changes by {text['slope']} per decade, "
                f"{text['bend']} per decade squared{turns}.")
