"""What the torque sensors read: joint torques through the belt, the gears and their losses.

    belt   T_1 = tau_1 - r tau_2,  T_2 = r tau_2          virtual work with q_2 = r (psi_2 - psi_1)             [N m]
    gear   sensor = T / ratio on the motor side; with efficiency eta, T / (ratio eta) while the motor drives
           (T psid > 0), T eta / ratio while it is driven, lossless at rest

The belt's map holds for every load: link 2's own moment never reaches motor 1.
Source: Rivera (1995), eq. 3-3-16 and section 4.1; pulley ratio and efficiency are ours.
"""

import torch
from torch import Tensor

from nnhydro.recordings.arm import Arm


def to_drives(tau: Tensor, arm: Arm) -> Tensor:
    """Return the torques at the drives, before any gear, of joint torques `tau` (n, joints, ...) N m."""
    if arm.drive.kind == "direct":
        return tau
    r = arm.drive.pulley_ratio
    return torch.stack([tau[:, 0] - r * tau[:, 1], r * tau[:, 1]], dim=1)


def drive_rates(qd: Tensor, arm: Arm) -> Tensor:
    """Return the drives' rates psid (n, joints) rad/s, on the joint side of the gears."""
    if arm.drive.kind == "direct":
        return qd
    return torch.stack([qd[:, 0], qd[:, 0] + qd[:, 1] / arm.drive.pulley_ratio], dim=1)


def gear_factor(drive_torque: Tensor, qd: Tensor, arm: Arm) -> Tensor:
    """Return sensor torque / drive torque (n, joints), for the drive torques (n, joints) N m and joint rates (n, joints) rad/s."""
    gears = [arm.gear_of(joint) for joint in range(arm.n_links)]
    if all(gear.torque_at == "output" for gear in gears):
        return torch.ones_like(drive_torque)
    power = drive_torque * drive_rates(qd, arm)
    factors = []
    for joint, gear in enumerate(gears):
        if gear.torque_at == "output":
            factors.append(torch.ones_like(power[:, joint]))
            continue
        factors.append(gear.efficiency ** -torch.sign(power[:, joint]) / gear.ratio)
    return torch.stack(factors, dim=1)


def sensor_torque(tau: Tensor, qd: Tensor, arm: Arm) -> Tensor:
    """Return what the torque sensors read (n, joints) N m for joint torques `tau` and joint rates `qd`, both (n, joints)."""
    drive = to_drives(tau, arm)
    return drive * gear_factor(drive, qd, arm)


def sensed_columns(columns: Tensor, total: Tensor, qd: Tensor, arm: Arm) -> Tensor:
    """Return columns (n, joints, p) of joint torque as sensors see them; the sum `total` (n, joints) N m says which way gears drive."""
    return to_drives(columns, arm) * gear_factor(to_drives(total, arm), qd, arm)[..., None]


def joint_torque(sensor: Tensor, qd: Tensor, arm: Arm) -> Tensor:
    """Return the joint torques (n, joints) N m behind the sensor torques `sensor`: the inverse of `sensor_torque`."""
    # the factor is positive, so the sign of the power can be taken from the sensor torque itself
    drive = sensor / gear_factor(sensor, qd, arm)
    if arm.drive.kind == "direct":
        return drive
    tau2 = drive[:, 1] / arm.drive.pulley_ratio
    return torch.stack([drive[:, 0] + drive[:, 1], tau2], dim=1)
