"""Hypothesis: drag lags behind the motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.wake_memory import relaxed


@effect
@final
@dataclass(frozen=True)
class FlowMemory(LoadEffect):
    """The low-passed drag of each link less the drag itself."""

    id = "flow_memory"
    family = "wake"
    name = "drag that lags"
    mechanism = "The wake takes time to follow a change of speed: the drag of now belongs to the motion of a moment ago."
    equation = "f -> f + m_i (low-pass(f_D; T) - f_D),  f_D the drag of link i for C_D = 1"
    source = "first-order wake response: an assumption of ours"
    signature = Signature(
        depends_on=("w", "t"), parity="odd", region="quick changes of speed; nothing in steady motion",
        excited_by="oscillations at several frequencies and the same speed",
        mistaken_for=("sensor_timing", "wake_development", "joint_elasticity", "history_force", "added_mass"),
    )
    acts = "arm"
    needs_water = True

    share: Values = parameter("1", 0.5, (0.0, 5.0), "part of C_D that lags, m_i")
    response: Values = parameter("s", 0.2, (0.005, 10.0), "response time T", per="arm", linear=False,
                                 grid=(0.03, 0.06, 0.12, 0.25, 0.5, 1.0))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d share, (n, joints, links)."""
        now = torch.cat(NormalDrag(self.share).loads(flow), dim=1)  # forces and moments of the links
        if flow.motion.steady or len(now) < 2:
            return flow.normal_columns(*torch.zeros_like(now).chunk(2, dim=1))
        steps = torch.diff(flow.motion.t, prepend=flow.motion.t[:1])[:, None] / self.response[0]
        return flow.normal_columns(*(relaxed(now, steps, now[0]) - now).chunk(2, dim=1))

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        parts = [text for name, text in said.items() if name != "response"]
        return f"Drag lags behind the motion by about {said['response']}; of each link's C_D {', '.join(parts)} take part."
