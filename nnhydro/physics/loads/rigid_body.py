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

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import ANY_SIZE, ANY_VALUE, LinearTerm, Values, parameter
from nnhydro.recordings.arm import Arm


def _inboard(x: Tensor) -> Tensor:
    """The sum (n, links) of `x` over the links inboard of each."""
    return x.cumsum(dim=1) - x


@final
@dataclass(frozen=True)
class RigidBody(LinearTerm):
    """Rigid-body torques of the dry arm; parameters are moments of mass about each link's own joint."""

    kind: ClassVar[str] = "rigid_body"
    row_by_row = True
    mass: Values = parameter("kg", 1.0, ANY_SIZE, "mass of the link")
    first_moment: Values = parameter("kg m", 0.1, ANY_VALUE, "mass times distance of the mass centre from the joint")
    second_moment: Values = parameter("kg m^2", 0.1, ANY_SIZE, "moment of inertia about the joint")

    @classmethod
    def of_arm(cls, arm: Arm) -> "RigidBody":
        """Return the rigid body that arm.yaml states."""
        links = arm.links
        return cls(tuple(link.mass_kg for link in links), tuple(link.mass_kg * link.com_m for link in links),
                   tuple(link.inertia_kg_m2 + link.mass_kg * link.com_m**2 for link in links))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (m, h, J), (n, joints, 3 links), with the rows of the hub where the flow has them."""
        return flow.arm_memo.of(RigidBody, lambda: self._columns(flow))

    @staticmethod
    def _columns(flow: Flow) -> Tensor:
        links, rate, acc, (cos, sin) = flow.arm.n_links, flow.A, flow.M, flow.cos_sin
        pull = rate * rate
        swing = -acc * sin - pull * cos, acc * cos - pull * sin  # X, Y: acceleration of a link's points per metre from its joint
        base, du0 = flow.motion.base, flow.motion.du0
        hub = torch.zeros_like(du0) if base is None else base.ax, du0 + flow.arm.gravity_m_s2
        joint_acc = [start[:, None] + _inboard(flow.L * x) for start, x in zip(hub, swing, strict=True)]
        if flow.arm.sliding:
            moved = flow.motion.qdd[:, 0] + hub[1] * cos[:, 0] - hub[0] * sin[:, 0]
            return torch.stack([moved, *[torch.zeros_like(du0)] * 2], dim=1)[:, None]
        place = [_inboard(flow.L * x) for x in flow.cos_sin]
        weight = cos * joint_acc[1] - sin * joint_acc[0]  # (n, links): e x a
        none = torch.zeros_like(du0)
        rows = []
        for j in range(links):
            mass, first, second = [none] * links, [none] * links, [none] * links
            for i in range(j, links):
                first[i], second[i] = weight[:, i], acc[:, i]
                if i > j:
                    x, y = (along[:, i] - along[:, j] for along in place)
                    mass[i] = x * joint_acc[1][:, i] - y * joint_acc[0][:, i]
                    first[i] = first[i] + x * swing[1][:, i] - y * swing[0][:, i]
            rows += mass + first + second
        columns = torch.stack(rows, dim=1).reshape(len(du0), links, 3 * links)
        if flow.hub:
            force = torch.stack([torch.cat([a, b, torch.zeros_like(b)], dim=1) for a, b in zip(joint_acc, swing, strict=True)], dim=1)
            columns = torch.cat([columns, force], dim=1)
        return columns


def inertial_directions(arm: Arm) -> NDArray[np.float64]:
    """Return F (3 links, r) of (m, h, J), ordered as `RigidBody`'s columns; a column for each of m, c, I that is not exactly known.

    A column is what a deviation by `known_to` adds: d(m, h, J) = G d(m, c, I), so that F F' = k^2 G diag(m^2, c^2, I^2) G'.
    """
    links, columns = arm.n_links, []
    for i, link in enumerate(arm.links):
        m, c, inertia, k = link.mass_kg, link.com_m, link.inertia_kg_m2, link.known_to
        for deviation, gradient in ((k * m, (1.0, c, c**2)), (k * abs(c), (0.0, m, 2 * m * c)), (k * inertia, (0.0, 0.0, 1.0))):
            column = np.zeros(3 * links)
            column[[i, links + i, 2 * links + i]] = deviation * np.array(gradient)
            if column.any():
                columns.append(column)
    return np.array(columns).T.reshape(3 * links, len(columns))
