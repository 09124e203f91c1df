"""Where the links point: inter-link angles, and the absolute angles where the water or gravity gives them a meaning.

    m sin q_i, cos q_i (i > 1)          planar angle between the links
    u_x,i / (V_i + |u_x,i|)             how far the flow runs along the link
    sin phi_i, cos phi_i                only where the arm stands upright (weight)

m = a / (a + STILL^2), a = sum_i V_i^2 + W_i D_i, is 1 in motion and 0 at rest: in still water a bent arm needs no torque to stay bent.
Source: Rivera (1995), section 3.1 (planar angle as an input of the network).
"""

import torch
from torch import Tensor

from nnhydro.features.feature_set import Features, View, feature_set
from nnhydro.features.groups import STILL
from nnhydro.features.scaling import acceleration_scale, speed_scale
from nnhydro.physics.flow import Flow


def in_motion(flow: Flow) -> Tensor:
    """Return m (n, 1), 1 in motion and 0 at rest."""
    activity = (speed_scale(flow) ** 2 + acceleration_scale(flow) * flow.D).sum(dim=1, keepdim=True)
    share: Tensor = activity / (activity + STILL**2)
    return share


@feature_set("angles")
def angles(view: View) -> Features:
    """Return inter-link angles and the share of axial flow; with gravity, also the absolute angles."""
    flow = view.flow
    between = flow.motion.q[:, 1:]
    odd = [torch.sin(between) * in_motion(flow)]
    even = [torch.cos(between), flow.u_x / (speed_scale(flow) + flow.u_x.abs() + STILL)]
    if flow.arm.gravity_m_s2 > 0:
        odd.append(torch.cos(flow.phi))
        even.append(torch.sin(flow.phi))
    return Features(torch.cat(odd, dim=1), torch.cat(even, dim=1))
