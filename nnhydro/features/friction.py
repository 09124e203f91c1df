"""Friction at the joints in absolute size: what the Morison scale, which grows with the motion, would otherwise hide.

    S_0j / S_j tanh(qd_k / v)   dry friction of joint k at drive j, v = 0.02 and 0.2 rad/s: sliding, and letting go
    S_0j / S_j qd_k / v_0       viscous, v_0 = 1 rad/s

S_0 is the floor of the scale S: after multiplication by S a constant coefficient is a constant torque. A belt drive carries the friction of
the elbow to motor 1 as well, hence every pair of joint and drive. Source: Rivera (1995), section 3.2 (one friction law a joint).
"""

import torch

from nnhydro.features.feature_set import Features, View, feature_set
from nnhydro.features.morison import CREEP, SLOW
from nnhydro.features.scaling import morison_scale

UNIT_RATE = 1.0  # rad/s


@feature_set("friction")
def friction(view: View) -> Features:
    """Return 3 joints x joints odd ones."""
    flow = view.flow
    motion = morison_scale(flow, torch.zeros_like(view.scale[:1]))
    share = (view.scale - motion) / view.scale  # (n, joints), S_0/S
    qd = flow.motion.qd
    law = torch.cat([torch.tanh(qd / CREEP), torch.tanh(qd / SLOW), qd / UNIT_RATE], dim=1)
    odd = (share[:, :, None] * law[:, None, :]).flatten(1)
    return Features(odd, odd[:, :0])
