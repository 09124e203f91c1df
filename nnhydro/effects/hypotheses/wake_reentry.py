"""Hypothesis: the wake catches up with a link that stops, or the link meets its own wake when it turns back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self, final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.physics.carried import StepMemory
from nnhydro.physics.flow import Flow, sum_over_links
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.wake_memory import dragged_along, overtaking, overtaking_by_law

STRIPS = 10  # a link


def _arm_torque(flow: Flow, f: Tensor) -> Tensor:
    """Return the joint torques (n, joints) of the drag that `f` (n, links, s) m^2/s^2 stands for."""
    return sum_over_links(Strips.of(flow, STRIPS).to_joints(0.5 * flow.rho * flow.D[:, None] * f))


@effect
@final
@dataclass(frozen=True)
class WakeReentry(LoadEffect):
    """Water set in motion before runs ahead of the strip: the strip's drag is that of its speed through this water."""

    id = "wake_reentry"
    family = "wake"
    name = "meeting one's own wake"
    mechanism = "The link drags water along. When the link stops, this water pushes it; when it turns back, it meets this water."
    equation = ("f = 1/2 rho D (-2 kappa_1 |w| o - 2 kappa_0 |w| (m - o) + kappa_2 (|w - o| (w - o) - |w| w + 2 |w| o)), the drag of "
                "w - a m expanded in a;  o how much faster the wake m runs than the strip, along m;  dv/dt = (w - v) k,  "
                "k = max(|w|, |v|)/(lambda D) + r,  s dm/dt = (v - m) k,  m = v where s = 0")
    source = ("wake effects of the flow's history: Lambrakos, Chao, Beckmann & Brannon (1987), Ocean Engineering 14, 117, abstract at "
              "https://data.zhenzhi.com/details/1/991698719; a velocity changed by the wake that is met at a reversal: Sabag, Edge & "
              "Soedigdo, Wake II model, abstract on td.alljournals.com.cn; McLain & Rock (1998) restrict themselves to starts from "
              "rest for this reason; the form is ours")
    signature = Signature(
        depends_on=("w", "motion before"), parity="odd", region="after stops and reversals",
        excited_by="stops, pauses and reversals after long strokes",
        mistaken_for=("wake_development", "flow_memory", "history_force", "link_interference"),
    )
    acts = "arm"
    needs_water = True
    predictable_share = 0.8  # vortices that run into a link do so in their own ways

    slowing: Values = parameter("1", 0.2, (0.0, 5.0), "kappa_1 while the link keeps moving", per="arm")
    meeting: Values = parameter("1", 0.2, (0.0, 5.0), "kappa_1 after it has turned back", per="arm")
    push: Values = parameter("1", 0.2, (0.0, 5.0), "kappa_2, the push of the lead's square on a link at rest", per="arm")
    length: Values = parameter("1", 5.0, (0.5, 300.0), "diameters over which the wake settles, lambda", per="arm", linear=False,
                               grid=(2.0, 6.0, 18.0, 60.0))
    fading: Values = parameter("1/s", 0.0, (0.0, 20.0), "rate at which the wake also settles by itself, r", per="arm", linear=False,
                               grid=(0.0, 1.0, 2.5))
    following: Values = parameter("1", 0.2, (0.0, 5.0), "kappa_0, of the wake that the link has not left behind", per="arm", absent=True)
    second: Values = parameter("1", 0.0, (0.0, 2.0), "lag of the water around the wake over the lag of the wake, s", per="arm",
                               linear=False, grid=(0.0, 0.5), absent=True)

    def narrower(self) -> tuple["WakeReentry", ...]:
        """Return the law of the water that runs ahead alone: a strip that goes on has the drag of still water."""
        return (replace(self, following=()),)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (slowing, meeting, push, following), (n, joints, 4), or of the first three."""
        w, carried = Strips.of(flow, STRIPS).w, flow.motion.carried
        if flow.motion.steady and carried is None:
            return torch.zeros(len(w), flow.arm.n_links, 3 + len(self.following), dtype=torch.float64)
        key = (type(self), "columns", *self._law, self.second)
        first = flow.memo.of(key, lambda: self._columns(flow, w))  # of both laws, with `following` and without
        if not self.following:
            return torch.stack(first[:3], dim=-1)
        last = flow.memo.of((*key, "following"), lambda: _arm_torque(flow, -2 * w.abs() * (first[3] - first[4])))
        return torch.stack([*first[:3], last], dim=-1)

    def _columns(self, flow: Flow, w: Tensor) -> tuple[Tensor, ...]:
        """d tau / d (slowing, meeting, push), (n, joints) each, the water behind the strips and how much faster it runs (n, links, s)."""
        carried = flow.motion.carried
        m = self._behind(flow, w) if carried is None else self._carried_wake(flow, w, carried)
        o = torch.sign(m) * (m.abs() - (w * torch.sign(m)).clamp(min=0)).clamp(min=0)
        first = -2 * w.abs() * o
        rest = (w - o).abs() * (w - o) - w.abs() * w - first
        back = m * w < 0
        return *(_arm_torque(flow, f) for f in (torch.where(back, 0.0, first), torch.where(back, first, 0.0), rest)), m, o

    def _carried_wake(self, flow: Flow, w: Tensor, carried: StepMemory) -> Tensor:
        """The water behind the strips of arms that are stepped through time: the wake v and what it drags along, from step to step."""
        reach, second = self.length[0] * flow.D[:, None], self.second[0] if self.second else 0.0

        def following(old: Tensor) -> Tensor:
            """Return (v, m) m/s a step after `old`, (..., 2)."""
            v, m = old.unbind(-1)
            rate = (torch.maximum(w.abs(), v.abs()) / reach + self.fading[0]) * carried.steps(3)
            v = w + (v - w) * torch.exp(-rate)
            return torch.stack([v, v + (m - v) * torch.exp(-rate / second) if second > 0 else v], dim=-1)

        name = f"wake velocity/{self.length[0]}/{self.fading[0]}/{second}"
        return carried.value(name, lambda: torch.stack([w, w], dim=-1), following)[..., 1]

    @property
    def _law(self) -> tuple[float, float]:
        """Length and fading of the wake: all that it depends on."""
        return self.length[0], self.fading[0]

    @classmethod
    def _common_wakes(cls, flow: Flow) -> dict[tuple[float, float], tuple[Tensor, Tensor]]:
        """The wakes of laws that were computed together, and their rates, (n, links, s) each."""
        return flow.memo.of((cls, "wakes"), dict[tuple[float, float], tuple[Tensor, Tensor]])

    @classmethod
    def prepare(cls, flows: Sequence[Flow], terms: Sequence[Self]) -> None:
        """Compute the wakes of all `terms` in one pass over the rows: ten laws, or ten flows, take hardly longer than one."""
        motion, links, laws = flows[0].motion, flows[0].arm.n_links, list(dict.fromkeys(term._law for term in terms))
        if motion.steady or motion.carried is not None or len(laws) * len(flows) < 2:
            return
        lengths, fading = (torch.tensor(values, dtype=torch.float64) for values in zip(*laws, strict=True))
        w = torch.cat([Strips.of(flow, STRIPS).w for flow in flows], dim=1)  # the flows side by side, as more links
        wakes = overtaking_by_law(motion.t, w, lengths[:, None, None] * flows[0].D.repeat(len(flows))[:, None], fading)
        for flow, *both in zip(flows, *(torch.split(x, links, dim=2) for x in wakes), strict=True):
            cls._common_wakes(flow).update(zip(laws, zip(*both, strict=True), strict=True))

    def _behind(self, flow: Flow, w: Tensor) -> Tensor:
        """The water behind the strips."""
        common, second = self._common_wakes(flow), self.second[0] if self.second else 0.0
        if self._law not in common:
            return overtaking(flow.motion.t, w, self.length[0] * flow.D[:, None], self.fading[0], second)
        return dragged_along(*common[self._law], second)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        goes_on = f" While the link keeps moving, it is {text['following']} of the wake's whole speed." if self.following else ""
        return (f"The arm meets its own wake. After a stop, the wake pushes the link with a C_D of {text['push']}. While the link slows "
                f"down, C_D times the acting share of the wake's excess speed is {text['slowing']}; after a reversal it is "
                f"{text['meeting']}.{goes_on} The wake decays over {text['length']} diameters and at {text['fading']}{self._twice(text)}.")

    def _twice(self, text: Mapping[str, str]) -> str:
        """How much later the water is met that the wake itself drags along, in words."""
        return f"; the water around it follows with {text['second']} times this lag" if any(self.second) else ""
