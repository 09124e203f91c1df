"""Inertia of motors and gears, each on the acceleration of its own drive.

    T_j = J_j psidd_j           at the drive, psi_j its angle (q_j where the joint is driven directly)              [N m]

    J_j   inertia as felt at the joint: ratio^2 times that of the rotor                                             [kg m^2]

Behind a belt (`drive: remote`) the joint torques are T_1 + T_2 and T_2 / r. Source: reflected inertia, from general knowledge; the belt's
map: physics/transmission.py.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.joints import diagonal_columns
from nnhydro.physics.load_term import ANY_SIZE, LinearTerm, Values, parameter
from nnhydro.physics.transmission import drive_rates


@final
@dataclass(frozen=True)
class RotorTerm(LinearTerm):
    """One inertia a drive."""

    kind: ClassVar[str] = "rotor_inertia"
    row_by_row = True
    inertia: Values = parameter("kg m^2", 0.05, ANY_SIZE, "inertia of rotor and gear as felt at the joint", per="joint")

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d inertia, (n, joints, joints)."""
        per_joint, arm = diagonal_columns(drive_rates(flow.motion.qdd, flow.arm)), flow.arm
        if arm.drive.kind == "direct":
            return per_joint
        return torch.stack([per_joint[:, 0] + per_joint[:, 1], per_joint[:, 1] / arm.drive.pulley_ratio], dim=1)
