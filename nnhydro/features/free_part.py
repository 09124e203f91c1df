"""What the mirror image of the rig need not repeat: loads of whatever is fixed to the tank, seen from absolute angles.

    tau_j = s_j sum_k c_jk f_k(q, qd)                                                       [N m]

    f   1;  Gaussians of width 1/2 in each u_i and in the pair (u_1, u_2);  qd_i qd_k / (largest rate)^2
    u_i angle of joint i, from -1 to 1 over the range of training and held there; q_1 is the absolute angle of link 1

A hose, a slack line, a current, a tilted plane and a bent link load the arm in ways that no mirror image of its motion shows. The functions
know nothing of any of them; s_j is the rms torque. Their coefficients are penalised apart, and used only where recordings held out of the
fit ask for them (fitting/network/linear_part.py). Source: radial basis functions, Broomhead & Lowe (1988); the choice is ours.
"""

from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import final

import torch
from torch import Tensor

from nnhydro.physics.flow import Flow

CENTRES, PAIR = 7, 6  # Gaussians a joint, and along each side of the plane of the first two
WIDTH = 0.5  # of half the range
NARROW = 0.02  # rad: a joint that moves less tells nothing about its angle
SLOWEST = 1e-3  # rad/s


def _joints(flow: Flow) -> tuple[Tensor, Tensor]:
    """Angles and rates (n, links), absolute for the first link where its base turns: what is fixed to the tank does not."""
    m = flow.motion
    if m.base is None or flow.arm.sliding:
        return m.q, m.qd
    return torch.cat([flow.phi[:, :1], m.q[:, 1:]], dim=1), torch.cat([flow.A[:, :1], m.qd[:, 1:]], dim=1)


@final
@dataclass(frozen=True, eq=False)
class FreeRange:
    """What training saw: lowest and highest angle (links,) rad, and the largest rate of each joint (links,) rad/s."""

    lowest: Tensor
    highest: Tensor
    fastest: Tensor

    @staticmethod
    def of(flow: Flow) -> "FreeRange":
        """Return the range of one motion."""
        q, qd = _joints(flow)
        return FreeRange(q.amin(dim=0), q.amax(dim=0), qd.abs().amax(dim=0))

    def and_of(self, other: "FreeRange") -> "FreeRange":
        """Return the range of both."""
        return FreeRange(torch.minimum(self.lowest, other.lowest), torch.maximum(self.highest, other.highest),
                         torch.maximum(self.fastest, other.fastest))

    def tensors(self) -> dict[str, Tensor]:
        """Return the tensors that a model file holds."""
        return {"lowest": self.lowest, "highest": self.highest, "fastest": self.fastest}


def _bumps(u: Tensor, count: int) -> Tensor:
    """Gaussians (n, count) of u (n,) at evenly spaced centres from -1 to 1."""
    centres = torch.linspace(-1.0, 1.0, count, dtype=torch.float64)
    return torch.exp(-(((u[:, None] - centres) / WIDTH) ** 2))


def free_functions(flow: Flow, seen: FreeRange) -> Tensor:
    """Return f (n, k), the same for every joint."""
    q, qd = _joints(flow)
    half = ((seen.highest - seen.lowest) / 2).clamp(min=NARROW)
    u = ((q - (seen.highest + seen.lowest) / 2) / half).clamp(-1.0, 1.0)
    rate = (qd / seen.fastest.clamp(min=SLOWEST)).clamp(-1.0, 1.0)
    links = range(q.shape[1])
    found = [torch.ones_like(u[:, :1]), *(_bumps(u[:, i], CENTRES) for i in links)]
    if len(links) > 1:
        first, second = (_bumps(u[:, i], PAIR) for i in (0, 1))
        found.append((first[:, :, None] * second[:, None, :]).flatten(1))
    found += [rate[:, i:i + 1] * rate[:, k:k + 1] for i, k in combinations_with_replacement(links, 2)]
    return torch.cat(found, dim=1)
