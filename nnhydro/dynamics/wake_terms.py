"""Effects with memory of their own, as terms that can be stepped through time; along a whole run they are the effects themselves."""

from dataclasses import dataclass, replace
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.effects.flow_memory import STRIPS, TINY, FlowMemory
from nnhydro.effects.in_sector import InSector
from nnhydro.effects.wake_reentry import WakeReentry
from nnhydro.physics.carried import Carried
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel_term import TravelTerm, unit_drag

FEW = 1024  # rows: longer runs are worked off piece by piece, by the term itself


@final
@dataclass(frozen=True)
class SteppedFlowMemory(LoadTerm):
    """effects/flow_memory.py: g -> f_D + (g - f_D) exp(-|w| dt / (T |w| + l D))."""

    kind: ClassVar[str] = ""
    effect: FlowMemory

    def torque(self, flow: Flow) -> Tensor:
        """Return the joint torques (n, joints) N m."""
        carried = flow.motion.carried
        if carried is None:
            return self.effect.torque(flow)
        strips = Strips.of(flow, STRIPS)
        drag, w = unit_drag(strips), strips.w.abs()
        reach = self.effect.response[0] * w + self.effect.travel[0] * flow.D[:, None]
        name = f"lagging drag/{self.effect.response[0]}/{self.effect.travel[0]}"
        lagging = carried.value(name, lambda: drag, lambda old: drag + (old - drag) * torch.exp(-carried.steps(3) * w / (reach + TINY)))
        return strips.to_joints(lagging - drag) @ self.effect.linear_values()


@final
@dataclass(frozen=True)
class SteppedWakeReentry(LoadTerm):
    """effects/wake_reentry.py with the velocity v of the wake and that of the water it drags along, m, from one instant to the next."""

    kind: ClassVar[str] = ""
    effect: WakeReentry

    def _met(self, strips: Strips, carried: Carried) -> Tensor:
        """The velocity m (n, links, s) m/s of the water that the strips meet."""
        e, w = self.effect, strips.w
        reach, second = e.length[0] * strips.flow.D[:, None], e.second[0] if e.second else 0.0

        def following(old: Tensor) -> Tensor:
            v, m = old.unbind(-1)
            rate = (torch.maximum(w.abs(), v.abs()) / reach + e.fading[0]) * carried.steps(3)
            v = w + (v - w) * torch.exp(-rate)
            return torch.stack([v, v + (m - v) * torch.exp(-rate / second) if second > 0 else v], dim=-1)

        return carried.value(f"wake velocity/{e.length[0]}/{e.fading[0]}/{second}", lambda: torch.stack([w, w], dim=-1), following)[..., 1]

    def torque(self, flow: Flow) -> Tensor:
        """Return the joint torques (n, joints) N m."""
        carried, e = flow.motion.carried, self.effect
        if carried is None:
            return e.torque(flow)
        strips = Strips.of(flow, STRIPS)
        w, m = strips.w, self._met(strips, carried)
        lead = torch.sign(m) * (m.abs() - (w * torch.sign(m)).clamp(min=0)).clamp(min=0)
        first = -2 * w.abs() * lead
        rest = (w - lead).abs() * (w - lead) - w.abs() * w - first
        felt = torch.where(m * w < 0, e.meeting[0] * first, e.slowing[0] * first) + e.push[0] * rest
        return strips.to_joints(0.5 * flow.rho * flow.D[:, None] * felt).sum(-1)


@final
@dataclass(frozen=True)
class SteppedTravel(LoadTerm):
    """Any term with a coefficient over the travel: the curve first, then one load a strip, instead of a column for every ordinate."""

    kind: ClassVar[str] = ""
    term: TravelTerm

    def torque(self, flow: Flow) -> Tensor:
        """Return the joint torques (n, joints) N m."""
        if flow.motion.carried is None and len(flow.motion) > FEW:
            return self.term.torque(flow)
        state = self.term.state(flow)
        curves = torch.stack([self.term.curve(s, link) for link, s in enumerate(state.s_over_D.unbind(1))], dim=1)
        return state.strips.to_joints(self.term.unit_load(state, self.term.added_mass) * curves).sum(-1)


def stepped(term: LoadTerm) -> LoadTerm:
    """Return `term`, or what does the same and can be stepped through time."""
    if isinstance(term, InSector):
        return replace(term, term=stepped(term.term))
    if isinstance(term, TravelTerm):
        return SteppedTravel(term)
    if isinstance(term, FlowMemory):
        return SteppedFlowMemory(term)
    return SteppedWakeReentry(term) if isinstance(term, WakeReentry) else term
