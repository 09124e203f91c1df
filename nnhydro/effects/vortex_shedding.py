"""Hypothesis: vortices that leave the links shake them along the motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot, pi
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel_term import unit_drag

STRIPS = 64  # a link: with 20 the phase differs too much from strip to strip and the sum aliases


@effect
@final
@dataclass(frozen=True)
class VortexShedding(LoadEffect):
    """In-line force at twice the Strouhal frequency of each strip; the phase is each recording's own."""

    id = "vortex_shedding"
    family = "wake"
    name = "vortex shedding"
    mechanism = "Vortices leave the link left and right in turn; each gives a tug along the motion, the more often the faster it moves."
    equation = "f = 1/2 rho D |w| w (a cos psi + b sin psi),  dpsi/dt = 4 pi St |w| / D of each strip"
    source = "St about 0.2 and drag at twice the shedding frequency: Rivera (1995), section 2; coherence along the link is an assumption"
    signature = Signature(
        depends_on=("w", "path"), parity="odd", region="steady fast motion: a hum whose pitch follows the speed",
        excited_by="long strokes at constant speed, sampled quickly",
        mistaken_for=("torque_ripple", "wave_orbital", "flow_memory"),
    )
    acts = "arm"
    needs_water = True
    own_in_every_recording = True

    cosine: Values = parameter("1", 0.0, (-3.0, 3.0), "fluctuation of C_D, in phase with the start", per="arm")
    sine: Values = parameter("1", 0.0, (-3.0, 3.0), "fluctuation of C_D, a quarter cycle later", per="arm")
    strouhal: Values = parameter("1", 0.2, (0.05, 0.6), "Strouhal number St", per="arm", linear=False,
                                 grid=tuple(round(0.14 + 0.01 * k, 2) for k in range(14)))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (cosine, sine), (n, joints, 2); 0 in steady rows, which are means over many cycles."""
        strips = Strips.of(flow, STRIPS)
        w = strips.w
        if flow.motion.steady or len(w) < 2:
            return torch.zeros(len(w), flow.arm.n_links, 2, dtype=torch.float64)
        path = torch.cat([torch.zeros_like(w[:1]), torch.cumulative_trapezoid(w.abs(), flow.motion.t, dim=0)])
        psi = 4 * pi * self.strouhal[0] * path / flow.D[:, None]
        drag = unit_drag(strips)
        return torch.stack([strips.to_joints(drag * wave).sum(-1) for wave in (torch.cos(psi), torch.sin(psi))], dim=-1)

    def quantities(self) -> dict[str, Quantity]:
        """Return amplitude and Strouhal number."""
        return {"amplitude": Quantity(hypot(self.cosine[0], self.sine[0]), "1"), "strouhal": Quantity(self.strouhal[0], "1")}

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"Vortices shake the links along the motion: C_D swings by {said['amplitude']}, Strouhal number {said['strouhal']}."
