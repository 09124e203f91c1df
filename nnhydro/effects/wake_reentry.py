"""Hypothesis: the wake catches up with a link that stops, or the link meets its own wake when it turns back."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.wake_memory import overtaking

STRIPS = 10  # a link


@effect
@final
@dataclass(frozen=True)
class WakeReentry(LoadEffect):
    """Water set in motion before overtakes the strip: it pushes in the old direction."""

    id = "wake_reentry"
    family = "wake"
    name = "meeting one's own wake"
    mechanism = "The link drags water along. When it stops, that water runs on and pushes it; when it turns back, it runs into it."
    equation = "f = -1/2 rho D kappa |o| o,  o = m - w where the wake m runs ahead of the link, dm/dt = (w - m) max(|w|, |m|)/(lambda D)"
    source = "McLain & Rock (1998) restrict themselves to starts from rest for this reason; the form is ours"
    signature = Signature(
        depends_on=("w", "motion before"), parity="odd", region="after stops and reversals",
        excited_by="stops, pauses and reversals after long strokes",
        mistaken_for=("wake_development", "flow_memory", "history_force", "link_interference"),
    )
    acts = "arm"
    needs_water = True

    push: Values = parameter("1", 0.2, (0.0, 5.0), "kappa while the link goes on or stands", per="arm")
    meeting: Values = parameter("1", 0.2, (0.0, 5.0), "kappa after it has turned back", per="arm")
    length: Values = parameter("1", 5.0, (0.5, 60.0), "diameters over which the wake settles, lambda", per="arm", linear=False,
                               grid=(2.0, 5.0, 12.0, 25.0))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (push, meeting), (n, joints, 2)."""
        strips = Strips.of(flow, STRIPS)
        w = strips.w
        if flow.motion.steady:
            return torch.zeros(len(w), flow.arm.n_links, 2, dtype=torch.float64)
        m = overtaking(flow.motion.t, w, (self.length[0] * flow.D[:, None]))
        over = torch.where((m - w) * m > 0, m - w, torch.zeros_like(w))
        f = -0.5 * flow.rho * flow.D[:, None] * over.abs() * over
        against = (m * w < 0).to(torch.float64)
        # meeting: the link's own drag is the baseline's; what is left is the excess over it
        excess = torch.where(m * w < 0, f - 0.5 * flow.rho * flow.D[:, None] * w.abs() * w, f)
        return torch.stack([strips.to_joints(f * (1 - against)).sum(-1), strips.to_joints(excess * against).sum(-1)], dim=-1)

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"Its own wake catches up with the arm: it pushes with {said['push']} of the drag of its own speed after a stop and adds "
                f"{said['meeting']} after a reversal, fading over {said['length']} diameters.")
