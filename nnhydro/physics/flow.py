"""The water as each link meets it: normal and axial velocity and acceleration along the link, and the way loads reach the joints.

    u_y,i(x) = A_i x + B_i            normal velocity of the point x of link i                    [m/s]
    d/dt u_y,i(x) = M_i x + N_i       its time derivative in the link's own frame                 [m/s^2]
    u_x,i, du_x,i                     axial velocity and its time derivative, uniform along x     [m/s, m/s^2]

    A_i = sum_{p<=i} qd_p
    B_i = sum_{j<i} L_j phid_j cos(phi_i - phi_j) + u0 cos phi_i
    M_i = sum_{p<=i} qdd_p
    N_i = sum_{j<i} L_j [phidd_j cos(phi_i - phi_j) - phid_j (phid_i - phid_j) sin(phi_i - phi_j)] + du0 cos phi_i - u0 A_i sin phi_i

In general joint 1 moves with h(t) on a base of heading psi, and the water with v(t), the same all along a link. With r = h - v, phi_i holds
psi, A_i psid and M_i psidd, and in the lines above stand

    r.n_i for u0 cos phi_i,  r.e_i for u0 sin phi_i,  dr/dt.n_i - A_i r.e_i  and  dr/dt.e_i + A_i r.n_i for what follows the sums;

dv/dt is that which the link meets, which moves itself.

Source: Rivera (1995), eqs. 3-1-9 to 3-1-14, 3-1-31, 3-1-32 (formulas lost in print; re-derived as plain time derivatives).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi
from typing import Any, final

import numpy as np
import torch
from torch import Tensor

from nnhydro.physics.memo import Memo
from nnhydro.physics.motion import Motion, Water, tensor
from nnhydro.recordings.arm import Arm


def joint_by_joint(x: Tensor) -> Tensor:
    """Return `x` (n, ...) with all rows of one joint side by side in memory: what is computed from it runs along the rows.

    Row by row, each operation would start anew for the two or three links of a row, which takes several times as long.
    """
    return x.movedim(0, -1).contiguous().movedim(-1, 0)


def _repeat_rows(x: Any, times: int) -> Any:
    """The rows of `x`, a tensor (n, ...) or a tuple of them, so many times."""
    if isinstance(x, tuple):
        return tuple(_repeat_rows(part, times) for part in x)
    return torch.cat([x.movedim(0, -1)] * times, dim=-1).movedim(-1, 0)


def sum_over_links(columns: Tensor) -> Tensor:
    """Return the sum (n, joints) of `columns` (n, joints, links), link by link: torch's own sum over so few takes ten times as long."""
    first, *others = columns.unbind(-1)
    return sum(others, start=first)


@final
@dataclass(frozen=True, eq=False)
class Flow:
    """The kinematics of `motion` for `arm`; every quantity is computed once, when first asked for.

    `water` moves besides what the motion says of the water; at rest where neither says anything.
    """

    arm: Arm
    motion: Motion
    water: Water | None = None
    hub: bool = False  # loads reach two more rows after the joints: the force that the hub supplies along X and along Y, N

    @cached_property
    def memo(self) -> Memo:
        """What terms and hypotheses about this flow share."""
        return Memo()

    @property
    def rho(self) -> float:
        """Density of the water, kg/m^3."""
        return self.arm.fluid.density_kg_m3

    @property
    def nu(self) -> float:
        """Kinematic viscosity, m^2/s."""
        return self.arm.fluid.kinematic_viscosity_m2_s

    def in_water(self, velocity: Tensor, acceleration: Tensor) -> "Flow":
        """Return the flow in water that moves with these (n, 2), or (n, links, 2), besides what this flow's own water does."""
        more = Water(joint_by_joint(velocity), joint_by_joint(acceleration))
        made = replace(self, water=more if self.water is None else self.water + more)
        vars(made).update({name: getattr(self, name) for name in _OF_THE_ARM})
        return made

    def again(self) -> "Flow":
        """Return the same flow with a memo of its own; what is known of it is not computed again."""
        made = replace(self)
        vars(made).update({name: value for name, value in vars(self).items() if name != "memo"})
        return made

    @staticmethod
    def join(flows: Sequence["Flow"]) -> "Flow":
        """Return the rows of `flows` of one arm, one flow after the other, for terms that load each row by itself."""
        first = flows[0]
        water = Water.join([flow.water for flow in flows], [len(flow.motion) for flow in flows])
        made = Flow(first.arm, Motion.join([flow.motion for flow in flows]), water, first.hub)
        if all(flow.arm_memo is first.arm_memo for flow in flows):  # the same motion of the arm in other water
            vars(made).update({name: _repeat_rows(getattr(first, name), len(flows)) for name in _ROWS_OF_THE_ARM})
        return made

    @cached_property
    def arm_memo(self) -> Memo:
        """What the arm's own motion decides, in whatever water."""
        return Memo()

    @cached_property
    def L(self) -> Tensor:  # (links,) m
        """Lengths."""
        return tensor(self.arm.L)

    @cached_property
    def D(self) -> Tensor:  # (links,) m
        """Diameters."""
        return tensor(self.arm.D)

    @cached_property
    def phi(self) -> Tensor:  # (n, links) rad
        """Absolute angles; the link of a linear axis stands across its travel."""
        if self.arm.sliding:
            return torch.full_like(self.motion.q, self.arm.direction_rad - pi / 2)
        phi, base = joint_by_joint(self.motion.q.cumsum(dim=1)), self.motion.base
        return phi if base is None else phi + base.heading[:, None]

    @cached_property
    def A(self) -> Tensor:  # (n, links) rad/s
        """Absolute angular rates: the slope of the normal velocity."""
        if self.arm.sliding:
            return torch.zeros_like(self.motion.qd)
        A, base = joint_by_joint(self.motion.qd.cumsum(dim=1)), self.motion.base
        return A if base is None else A + base.rate[:, None]

    @cached_property
    def M(self) -> Tensor:  # (n, links) rad/s^2
        """Absolute angular accelerations: the slope of the normal acceleration."""
        if self.arm.sliding:
            return torch.zeros_like(self.motion.qdd)
        M, base = joint_by_joint(self.motion.qdd.cumsum(dim=1)), self.motion.base
        return M if base is None else M + base.acceleration[:, None]

    @cached_property
    def _inboard(self) -> Tensor:  # (links i, links j)
        """1 where link j lies inboard of link i."""
        n = self.arm.n_links
        return tensor(np.tril(np.ones((n, n)), -1))  # numpy: torch's tril wakes its threads, 2 ms a call on busy cores

    @cached_property
    def _bend(self) -> Tensor:  # (n, links i, links j) rad
        """phi_i - phi_j."""
        return self.phi[:, :, None] - self.phi[:, None, :]

    @cached_property
    def along(self) -> Tensor:  # (n, links i, links j) m
        """L_j cos(phi_i - phi_j) for j inboard of i: the lever of a normal load on link i, piece by piece."""
        return self._inboard * self.L * torch.cos(self._bend)

    @cached_property
    def across(self) -> Tensor:  # (n, links i, links j) m
        """L_j sin(phi_i - phi_j) for j inboard of i: the lever of an axial load on link i, piece by piece."""
        return self._inboard * self.L * torch.sin(self._bend)

    @cached_property
    def through_water(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:  # four of (n, 1) or (n, links), m/s and m/s^2
        """The motion of joint 1 through the water at each link, r_X, r_Y, and its time derivative."""
        m, waters = self.motion, [water for water in (self.motion.current, self.water) if water is not None]
        still = torch.zeros_like(m.u0)
        hub = (still if m.base is None else m.base.vx, m.u0, still if m.base is None else m.base.ax, m.du0)
        rx, ry, ax, ay = (x[:, None] for x in hub)
        for water in waters:
            vx, vy, slope_x, slope_y = water.at_links()
            rx, ry, ax, ay = rx - vx, ry - vy, ax - slope_x, ay - slope_y
        return rx, ry, ax, ay

    @cached_property
    def cos_sin(self) -> tuple[Tensor, Tensor]:  # two of (n, links)
        """cos phi and sin phi."""
        return torch.cos(self.phi), torch.sin(self.phi)

    def in_link_axes(self, x: Tensor, y: Tensor) -> tuple[Tensor, Tensor]:
        """Return the components across and along each link, (n, links) each, of vectors x, y in world axes, broadcast to (n, links)."""
        cos, sin = self.cos_sin
        return y * cos - x * sin, x * cos + y * sin

    @cached_property
    def _met(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:  # (n, links) m/s, m/s, m/s^2, m/s^2
        """The motion of joint 1 through the water across and along each link, and its derivative: r.n, r.e, dr/dt.n, dr/dt.e."""
        rx, ry, ax, ay = self.through_water
        return *self.in_link_axes(rx, ry), *self.in_link_axes(ax, ay)

    @cached_property
    def B(self) -> Tensor:  # (n, links) m/s
        """Normal velocity of the inboard joint of each link."""
        if self.arm.sliding:
            return self.motion.qd + self._met[0]
        return self._of_joints[0] + self._met[0]

    @cached_property
    def u_x(self) -> Tensor:  # (n, links) m/s
        """Axial velocity of each link."""
        return self._of_joints[1] + self._met[1]

    @cached_property
    def _of_joints(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:  # (n, links) m/s, m/s, m/s^2, m/s^2
        """What the joints inboard add to B, u_x, N and du_x: their own motion about joint 1."""
        turning = self.A[:, None, :] * (self.A[:, :, None] - self.A[:, None, :])  # phid_j (phid_i - phid_j), (n, links i, links j)
        (B, u_x), (N, du_x) = ([joint_by_joint(torch.einsum("nij,nj->ni", lever, x)) for lever in (self.along, self.across)]
                             for x in (self.A, self.M))
        return B, u_x, N - (self.across * turning).sum(-1), du_x + (self.along * turning).sum(-1)

    @cached_property
    def N(self) -> Tensor:  # (n, links) m/s^2
        """Normal acceleration (link frame) of the inboard joint of each link."""
        if self.arm.sliding:
            return self.motion.qdd + self._met[2]
        return self._of_joints[2] + self._met[2] - self.A * self._met[1]

    @cached_property
    def du_x(self) -> Tensor:  # (n, links) m/s^2
        """Axial acceleration (link frame) of each link."""
        return self._of_joints[3] + self._met[3] + self.A * self._met[0]

    @cached_property
    def outboard(self) -> Tensor:  # (joints j, links i)
        """1 where link i hangs on joint j."""
        n = self.arm.n_links
        return tensor(np.vstack([np.triu(np.ones((n, n))), np.zeros((2 if self.hub else 0, n))]))

    def _with_hub(self, lever: Tensor, x: Tensor, y: Tensor) -> Tensor:
        """`lever` (n, joints, links) with the rows of the hub, components x and y (n, links) of a unit load along X and Y."""
        return torch.cat([lever, x[:, None], y[:, None]], dim=1) if self.hub else lever

    @cached_property
    def lever_normal(self) -> Tensor:  # (n, joints j, links i) m
        """Lever about joint j of a normal load at joint i: sum_{p=j}^{i-1} L_p cos(phi_i - phi_p). Rivera (1995), eq. 3-1-22."""
        lever = joint_by_joint(self.along.flip(-1).cumsum(-1).flip(-1).transpose(1, 2))
        return self._with_hub(lever, -torch.sin(self.phi), torch.cos(self.phi))

    @cached_property
    def lever_axial(self) -> Tensor:  # (n, joints j, links i) m
        """Lever about joint j of an axial load on link i: sum_{p=j}^{i-1} L_p sin(phi_i - phi_p). Rivera (1995), eq. 3-1-28."""
        lever = joint_by_joint(self.across.flip(-1).cumsum(-1).flip(-1).transpose(1, 2))
        return self._with_hub(lever, torch.cos(self.phi), torch.sin(self.phi))

    def normal_columns(self, force: Tensor, moment: Tensor) -> Tensor:
        """Return the joint torques (n, joints, links) of normal loads, one column per link.

        `force` (n, links) N acts along n_i; `moment` (n, links) N m is the load's moment about the link's own joint. The joint of a linear
        axis feels the force itself.
        """
        if self.arm.sliding:
            return force[:, None, :]
        return self.outboard * moment[:, None, :] + self.lever_normal * force[:, None, :]

    def axial_columns(self, force: Tensor) -> Tensor:
        """Return the joint torques (n, joints, links) of axial loads `force` (n, links) N along e_i, one column per link."""
        return self.lever_axial * force[:, None, :]

    def middle_columns(self, across: Tensor, along: Tensor) -> Tensor:
        """Return the joint torques (n, joints, links) of forces across and along each link, (n, links) N each, at its middle."""
        return self.normal_columns(across, across * self.L / 2) + self.axial_columns(along)

    @cached_property
    def _frame(self) -> tuple[Tensor, Tensor]:  # two of (n, links, 2)
        """Unit vectors along and across each link, e_i and n_i, in world axes."""
        cos, sin = self.cos_sin
        return torch.stack([cos, sin], dim=-1), torch.stack([-sin, cos], dim=-1)

    @property
    def unit_along(self) -> Tensor:  # (n, links, 2)
        """Unit vector along each link, e_i, in world axes X, Y."""
        return self._frame[0]

    @cached_property
    def middle(self) -> Tensor:  # (n, links, 2) m
        """Where the middle of each link is, from the hub, in world axes X, Y."""
        length = self._inboard * self.L + torch.diag(self.L / 2)  # (links i, links j)
        middle = torch.einsum("ij,njk->nik", length, self._frame[0])
        return middle + self.motion.q[..., None] * self._frame[1] if self.arm.sliding else middle


_ROWS_OF_THE_ARM = ("phi", "A", "M", "along", "across", "_of_joints", "lever_normal", "lever_axial", "cos_sin")
_OF_THE_ARM = (*_ROWS_OF_THE_ARM, "L", "D", "_inboard", "outboard", "arm_memo")  # what water does not change
