"""Terms with a coefficient over the travel, a few rows at a time: the same torques as the terms themselves, in fewer operations."""

from dataclasses import dataclass, replace
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.effects.in_sector import InSector
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.travel.term import TravelTerm

FEW = 1024  # rows: longer runs are worked off piece by piece, by the term itself


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


def fast_stepper(term: LoadTerm) -> LoadTerm:
    """Return `term`, or what gives the same torques faster where a few rows are asked for."""
    if isinstance(term, InSector):
        return replace(term, term=fast_stepper(term.term))
    return SteppedTravel(term) if isinstance(term, TravelTerm) else term
