"""States as they are measured, and the dimensional parameters of Rivera's chapter 3, in SI: what other inputs have to beat.

    raw          qd_j, qdd_j; sin q_i, cos q_i (i > 1); carriage speed and acceleration along and across the first link
    dimensional  A_i, B_i, M_i, N_i, u_x,i, du_x,i of every link

The carriage is seen from the first link because the half turn of the rig must change nothing, and a bend counts only in motion (as in
geometry.py): a bent arm at rest in still water needs no torque. Source: Rivera (1995), section 2.4 (input sets), eqs. 3-1-9 to 3-1-14.
"""

import torch
from torch import Tensor

from nnhydro.features.feature_set import Features, View, feature_set
from nnhydro.features.geometry import in_motion
from nnhydro.physics.flow import Flow


def _hub(flow: Flow, first: Tensor) -> tuple[Tensor, Tensor]:
    """Speed and acceleration of joint 1 through the water across and along the first link, each (n, 2)."""
    rx, ry, ax, ay = (x[:, :1] for x in flow.through_water)
    cos, sin = torch.cos(first), torch.sin(first)
    return torch.cat([ry * cos - rx * sin, ay * cos - ax * sin], dim=1), torch.cat([rx * cos + ry * sin, ax * cos + ay * sin], dim=1)


@feature_set("raw", dimensional=True)
def raw(view: View) -> Features:
    """Return 2 joints + 2 and (links - 1) odd, (links - 1) + 2 even ones."""
    motion, first = view.flow.motion, view.flow.phi[:, :1]
    across, along = _hub(view.flow, first)
    between = motion.q[:, 1:]
    odd = [motion.qd, motion.qdd, across, torch.sin(between) * in_motion(view.flow)]
    return Features(torch.cat(odd, dim=1), torch.cat([along, torch.cos(between)], dim=1))


@feature_set("dimensional", dimensional=True)
def dimensional_parameters(view: View) -> Features:
    """Return 4 odd and 2 even ones a link."""
    flow = view.flow
    return Features(torch.cat([flow.A, flow.B, flow.M, flow.N], dim=1), torch.cat([flow.u_x, flow.du_x], dim=1))
