"""Dimensionless groups of each link, bounded where the document's forms are singular.

    Re_i     = V_i D_i / nu                     as log10(1 + Re/1e3)
    Re_rot,i = A_i L_i^2 / nu                   rotational Reynolds number, signed, as sgn log10(1 + |Re_rot|/1e3)
    direction of the flow along the link        (B, A L)/V instead of A L/B
    W_i D_i / V_i^2                             acceleration group (inverse of a Keulegan-Carpenter number), as x/(1+x)
    (N, M L)/W                                  direction of the acceleration
    L_i/D_i and, between links, h/D             constants of the arm

Source: Rivera (1995), eqs. 3-1-3 to 3-1-8, 3-1-24; bounded forms ours.
"""

import torch

from nnhydro.features.feature_set import Features, View, feature_set
from nnhydro.features.scaling import acceleration_scale, speed_scale

STILL = 1e-3  # m/s: below it a link counts as at rest and its direction of flow fades to zero
STEADY = 1e-2  # m/s^2: below it the direction of the acceleration fades to zero
RE0 = 1e3


@feature_set("groups")
def groups(view: View) -> Features:
    """Return 5 odd and 2 even groups a link."""
    flow = view.flow
    V, W = speed_scale(flow), acceleration_scale(flow)
    rotational = flow.A * flow.L**2 / flow.nu
    inverse_kc = W * flow.D / (V**2 + STILL**2)
    even = torch.cat([torch.log10(1 + V * flow.D / flow.nu / RE0), inverse_kc / (1 + inverse_kc)], dim=1)
    odd = torch.cat([
        torch.sign(rotational) * torch.log10(1 + rotational.abs() / RE0),
        flow.B / (V + STILL),
        flow.A * flow.L / (V + STILL),
        flow.N / (W + STEADY),
        flow.M * flow.L / (W + STEADY),
    ], dim=1)
    return Features(odd, even)


@feature_set("arm")
def arm_constants(view: View) -> Features:
    """Return L/D of each link and h/D between links, 2 links - 1 even ones: they only tell arms apart."""
    flow = view.flow
    h = torch.full((flow.arm.n_links - 1,), flow.arm.parallel_distance_m, dtype=torch.float64) / flow.D[1:]
    even = torch.cat([flow.L / flow.D, h]).expand(len(flow.motion), -1)
    return Features(even[:, :0], even)
