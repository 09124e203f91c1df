"""The dry arm: inertia, Coriolis and centrifugal torques, carriage acceleration and weight, exact for n links in a plane.

    tau_j = sum_{i>=j} [ m_i (P_ji x a_i) + h_i (e_i x a_i + P_ji x (phidd_i n_i - phid_i^2 e_i)) + J_i phidd_i ]      [N m]

    a_i   acceleration of joint i, carriage acceleration and weight (g along -Y) included                             [m/s^2]
    P_ji  vector from joint j to joint i                                                                              [m]
    m_i   mass [kg];  h_i = m_i Lc_i first moment about joint i [kg m];  J_i = I_i + m_i Lc_i^2 second moment [kg m^2]

Linear in (m, h, J). On a linear axis the moving mass alone counts: tau_1 = m (qdd_1 + a.d), d the direction of travel.
Source: Rivera (1995), eqs. 3-3-1 to 3-3-15 (two links); n links by Newton and Euler.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import ANY_SIZE, ANY_VALUE, LinearTerm, Values, parameter
from nnhydro.recordings.arm import Arm


def _cross(a: Tensor, b: Tensor) -> Tensor:
    """z component of a x b for plane vectors (..., 2)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


@final
@dataclass(frozen=True)
class RigidBody(LinearTerm):
    """Rigid-body torques of the dry arm; parameters are moments of mass about each link's own joint."""

    kind: ClassVar[str] = "rigid_body"
    mass: Values = parameter("kg", 1.0, ANY_SIZE, "mass of the link")
    first_moment: Values = parameter("kg m", 0.1, ANY_VALUE, "mass times distance of the mass centre from the joint")
    second_moment: Values = parameter("kg m^2", 0.1, ANY_SIZE, "moment of inertia about the joint")

    @classmethod
    def of_arm(cls, arm: Arm) -> "RigidBody":
        """Return the rigid body that arm.yaml states."""
        links = arm.links
        return cls(tuple(k.mass_kg for k in links), tuple(k.mass_kg * k.com_m for k in links),
                   tuple(k.inertia_kg_m2 + k.mass_kg * k.com_m**2 for k in links))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (m, h, J), (n, joints, 3 links), with the rows of the hub where the flow has them."""
        return flow.arm_memo.of(RigidBody, lambda: self._columns(flow))

    @staticmethod
    def _columns(flow: Flow) -> Tensor:
        links, phi, rate, acc = flow.arm.n_links, flow.phi, flow.A, flow.M
        e = torch.stack([torch.cos(phi), torch.sin(phi)], dim=-1)  # (n, links, 2)
        n = torch.stack([-e[..., 1], e[..., 0]], dim=-1)
        swing = acc[..., None] * n - (rate**2)[..., None] * e  # acceleration of a link's points per metre from its joint
        base, du0 = flow.motion.base, flow.motion.du0
        hub = torch.stack([torch.zeros_like(du0) if base is None else base.ax, du0 + flow.arm.gravity_m_s2], dim=-1)
        step = flow.L[:, None] * swing
        joint_acc = hub[:, None, :] + torch.cumsum(step, dim=1) - step  # (n, links, 2)
        reach = flow.L[:, None] * e
        joint_pos = torch.cumsum(reach, dim=1) - reach
        columns = torch.zeros(len(flow.motion), len(flow.outboard), 3 * links, dtype=torch.float64)
        if flow.arm.sliding:
            columns[:, 0, 0] = flow.motion.qdd[:, 0] + (hub * n[:, 0]).sum(dim=-1)
            return columns
        if flow.hub:
            columns[:, links:, :links], columns[:, links:, links:2 * links] = joint_acc.transpose(1, 2), swing.transpose(1, 2)
        for j in range(links):
            for i in range(j, links):
                columns[:, j, links + i] = _cross(e[:, i], joint_acc[:, i])
                columns[:, j, 2 * links + i] = acc[:, i]
                if i > j:
                    P = joint_pos[:, i] - joint_pos[:, j]
                    columns[:, j, i] = _cross(P, joint_acc[:, i])
                    columns[:, j, links + i] += _cross(P, swing[:, i])
        return columns
