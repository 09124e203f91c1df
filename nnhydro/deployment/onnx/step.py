"""A model as one step in time: the torques of an instant from its motion and from what the wake remembers, and the memory for the next.

    m' = bank(w, dt, m),     tau = model(q, qd, qdd, u0, du0, m')

w is the normal velocity of each strip, the bank is that of features/wake.py. Fed with the rows of a recording, one after the other, it
gives what `nnhydro predict` gives for the whole.
"""

from dataclasses import dataclass, replace
from typing import final

import torch
from torch import Tensor

from nnhydro.features.wake import STATES, STRIPS, next_state, stations
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion

NAMES = ("q", "qd", "qdd", "u0", "du0", "dt", "wake")


@final
@dataclass(frozen=True, eq=False)
class Step:
    """One step of `model`; `with_std` says whether it also gives its standard deviation."""

    model: TorqueModel
    with_std: bool

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Return the shape of each input."""
        n = self.model.arm.n_links
        return dict(zip(NAMES, ((n,), (n,), (n,), (1,), (1,), (1,), (STATES, n, STRIPS)), strict=True))

    def __call__(self, q: Tensor, qd: Tensor, qdd: Tensor, u0: Tensor, du0: Tensor, dt: Tensor, wake: Tensor) -> tuple[Tensor, ...]:
        """Return tau (links,) N m, its std where there is one, and the next memory, shaped as `wake`."""
        motion = Motion(torch.zeros(1, dtype=torch.float64), q[None], qd[None], qdd[None], u0, du0, steady=True)
        flow = Flow(self.model.arm, motion)
        w = (flow.A[:, :, None] * stations(flow) + flow.B[:, :, None])[0]
        after = next_state(w, dt, flow.D, flow.nu, wake)
        known = replace(motion, wake=after[:, None])
        tau, std = self.model.torque_and_std(known) if self.with_std else (self.model.torque(known), None)
        return (tau[0], after) if std is None else (tau[0], std[0], after)
