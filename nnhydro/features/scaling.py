"""The Morison scale: how large a torque at each drive the motion can be expected to need.

    S_j = sum_{i>=j} l_ji [ 1/2 rho D_i L_i V_i^2 + (rho pi D_i^2/4) L_i W_i + m_i R_i ] + S_0j           [N m]

    V_i^2 = B_i^2 + (A_i L_i)^2,  W_i = |N_i| + |M_i| L_i     speed and acceleration scales of link i       [m^2/s^2, m/s^2]
    R_i = |a_i| + (|M_i| + A_i^2) L_i                         acceleration scale of its mass; a_i that of its joint  [m/s^2]
    l_ji  = L_j + ... + L_{i-1} + L_i/2                       reach of link i from joint j                  [m]
    S_0j  a floor, so that friction at rest can be expressed

Torques divided by S are the dimensionless groups of Rivera's eqs. 3-1-3 to 3-1-8 with the bounded scale V (each form in the
document is singular where its own scale vanishes). Source: Rivera (1995), section 3.1; the sum over links is ours.
"""

import torch
from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.added_mass import displaced_mass
from nnhydro.recordings.arm import Arm

LEAST = 1e-30  # of a square: lost in the rounding of all but 0, where the root would have no slope


def root(x: Tensor) -> Tensor:
    """Return sqrt(x) of sums of squares x; where all of them vanish the slope is 0, as the mean of those on both sides."""
    return torch.sqrt(x + LEAST)


def speed_scale(flow: Flow) -> Tensor:
    """Return V (n, links) m/s."""
    return root(flow.B**2 + (flow.A * flow.L) ** 2)


def acceleration_scale(flow: Flow) -> Tensor:
    """Return W (n, links) m/s^2."""
    return flow.N.abs() + flow.M.abs() * flow.L


def rigid_scale(flow: Flow) -> Tensor:
    """Return R (n, links) m/s^2: unlike W it holds the centripetal acceleration, all that loads an arm without water at constant rates."""
    joint = root((flow.N + flow.A * flow.u_x) ** 2 + (flow.du_x - flow.A * flow.B) ** 2)  # 0 on a fixed base
    return joint + (flow.M.abs() + flow.A**2) * flow.L


def _reach(flow: Flow) -> Tensor:
    """l_ji (joints, links) m, zero for links inboard of the joint."""
    L = flow.L
    start = torch.cumsum(L, 0) - L
    return flow.outboard * (start[None, :] - start[:, None] + L[None, :] / 2)


def gear_ratios(arm: Arm) -> Tensor:
    """Return torque at the drive over torque at the sensor (joints,), losses aside."""
    gears = [arm.gear_of(j) for j in range(arm.n_links)]
    return torch.tensor([gear.ratio if gear.torque_at == "motor" else 1.0 for gear in gears], dtype=torch.float64)


def morison_scale(flow: Flow, floor: Tensor) -> Tensor:
    """Return S (n, joints) N m with the floor (joints,) N m; at a belt drive, motor 1 carries what the belt adds."""
    arm = flow.arm
    mass = torch.tensor([link.mass_kg for link in arm.links], dtype=torch.float64)
    water = displaced_mass(flow) * flow.L
    force = (0.5 * flow.rho * flow.D * flow.L * speed_scale(flow) ** 2 + water * acceleration_scale(flow) + mass * rigid_scale(flow)
             + (mass + water) * arm.gravity_m_s2)
    S = force @ _reach(flow).T
    if arm.drive.kind == "remote":
        r = arm.drive.pulley_ratio
        S = torch.stack([S[:, 0] + r * S[:, 1], r * S[:, 1]], dim=1)
    return S / gear_ratios(arm) + floor
