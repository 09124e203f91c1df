"""Morison-scaled inputs: the baseline's own torques, term by term, and the sign of each joint's rate.

    tau_term,j / S_j          drag, added mass and rigid body as the textbook gives them, divided by the Morison scale
    tanh(qd_j / v)            direction of each joint's rotation, v = 0.02 and 0.2 rad/s: what friction depends on

Source: Rivera (1995), eqs. 3-1-3 to 3-1-8 (scaled torques) and section 3.2 (friction follows the sign of the rate).
"""

import torch

from nnhydro.features.feature_set import Features, View, feature_set

CREEP, SLOW = 0.02, 0.2  # rad/s: a smooth sign, and the range in which seals let go


@feature_set("morison")
def morison(view: View) -> Features:
    """Return the scaled torques of the terms, joints x terms odd ones."""
    odd = view.scaled_terms.flatten(1)
    return Features(odd, odd[:, :0])


@feature_set("rates")
def rates(view: View) -> Features:
    """Return smooth signs of the joint rates at two widths, 2 joints odd ones."""
    qd = view.flow.motion.qd
    odd = torch.cat([torch.tanh(qd / CREEP), torch.tanh(qd / SLOW)], dim=1)
    return Features(odd, odd[:, :0])
