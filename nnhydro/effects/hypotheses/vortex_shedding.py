"""Hypothesis: vortices that leave the links shake them along the motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot, pi, sqrt
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.term import unit_drag

STRIPS = 64  # a link: with 20 the phase differs too much from strip to strip and the sum aliases


def in_cells(speed: Tensor, cell: Tensor) -> Tensor:
    """Return `speed` (n, links, s) averaged over cells of the length `cell` (links,) in lengths of the link; as it is where that is 0."""
    if not cell.any():
        return speed
    made = []
    for link, share in zip(speed.unbind(1), cell.tolist(), strict=True):
        wide = max(1, round(share * link.shape[1]))
        made.append(torch.cat([part.mean(dim=1, keepdim=True).expand_as(part) for part in torch.split(link, wide, dim=1)], dim=1))
    return torch.stack(made, dim=1)


def _phase(flow: Flow, cell: float) -> Tensor:
    """Phase psi / St (n, links, s) of each strip, in single precision, which is 1e-4 rad in psi."""
    speed = in_cells(Strips.of(flow, STRIPS).w.abs(), cell * flow.D / flow.L).numpy()
    path, steps = np.zeros_like(speed), np.diff(flow.motion.t.numpy())[:, None, None]
    np.cumsum((speed[1:] + speed[:-1]) * (steps / 2), axis=0, out=path[1:])  # torch's trapezoids take five times as long
    return (4 * pi * torch.from_numpy(path) / flow.D[:, None]).float()


def _unit_loads(flow: Flow) -> NDArray[np.float32]:
    """Force N and moment N m of each strip's unit drag, (n, links, s, 2)."""
    strips = Strips.of(flow, STRIPS)
    force = unit_drag(strips) * strips.ds[:, None]
    return torch.stack([force, force * strips.x], dim=-1).float().numpy()


@effect
@final
@dataclass(frozen=True)
class VortexShedding(LoadEffect):
    """In-line force at twice the Strouhal frequency of each strip or cell; each link has a phase per recording."""

    id = "vortex_shedding"
    family = "wake"
    cause = "shedding"
    name = "vortex shedding"
    mechanism = "Vortices leave the link on alternate sides. Each tugs the link along its motion, more often the faster it moves."
    equation = "f = 1/2 rho D |w| w (a_i cos psi + b_i sin psi),  dpsi/dt = 4 pi St <|w|> / D,  <> the mean over a cell of the span"
    source = ("St about 0.2 and drag at twice the shedding frequency: Rivera (1995), section 2; cells of unlike frequency along a "
              "span: Williamson (1989), J. Fluid Mech. 206, 579, abstract at "
              "http://sciencedocbox.com/Space_and_Astronomy/68503217-Oblique-and-parallel-modes-of-vortex-shedding-"
              "in-the-wake-of-a-circular-cylinder-at-low-reynolds-numbers.html (at low Reynolds numbers); "
              "cells in shear: from general knowledge, not checked")
    signature = Signature(
        depends_on=("w", "path"), parity="odd", region="steady fast motion: a hum whose pitch follows the speed",
        excited_by="long strokes at constant speed, sampled quickly",
        mistaken_for=("torque_ripple", "wave_orbital", "flow_memory"),
    )
    acts = "arm"
    needs_water = True
    per_recording = True

    cosine: Values = parameter("1", 0.0, (-3.0, 3.0), "fluctuation of C_D, in phase with the start")
    sine: Values = parameter("1", 0.0, (-3.0, 3.0), "fluctuation of C_D, a quarter cycle later")
    strouhal: Values = parameter("1", 0.2, (0.05, 0.6), "Strouhal number St", per="arm", linear=False,
                                 grid=tuple(round(0.15 + 0.0025 * k, 4) for k in range(41)))  # a recording is long: phases part soon
    cell: Values = parameter("1", 0.0, (0.0, 100.0), "length of a cell that sheds at one frequency, in diameters; 0: none", per="arm",
                             linear=False, grid=(0.0, 5.0))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (cosine, sine), (n, joints, 2 links); 0 in steady rows, which are means over many cycles."""
        n, links = flow.motion.q.shape
        if flow.motion.steady or n < 2:
            return torch.zeros(n, links, 2 * links, dtype=torch.float64)
        psi = self.strouhal[0] * flow.memo.of((type(self), self.cell[0]), lambda: _phase(flow, self.cell[0]))
        waves, loads = torch.stack([torch.cos(psi), torch.sin(psi)], dim=-2).numpy(), flow.memo.of(type(self), lambda: _unit_loads(flow))
        both = torch.from_numpy(waves @ loads).to(torch.float64)  # (n, links, 2, 2); torch's product takes four times as long
        made = [flow.normal_columns(*wave.unbind(-1)) for wave in both.unbind(-2)]
        return torch.cat(made, dim=-1)

    def quantities(self) -> dict[str, Quantity]:
        """Return amplitude and Strouhal number."""
        size = hypot(*self.cosine, *self.sine) / sqrt(len(self.cosine))
        return {"amplitude": Quantity(size, "1", length=True), "strouhal": Quantity(self.strouhal[0], "1")}

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"Vortex shedding shakes the links along their motion: C_D oscillates by {text['amplitude']}, "
                f"at a Strouhal number of {text['strouhal']}.")
