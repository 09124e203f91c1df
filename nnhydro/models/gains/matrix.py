"""The gain matrix of a model: how its torques change with each input, state by state.

    G_j. = d tau_j / d (q, qd, qdd, u0, du0)          [N m/rad, N m s/rad, kg m^2, N s, kg m]

d tau_j/d qd_j is the effective damping of joint j (twice the torque over the speed, for a drag that grows with its square), d tau_j/d qdd_j
its effective inertia: link, water and all that a learned model has found. A controller that linearises the arm uses just these numbers.

Every state stands for itself: the wake behind it has developed, as in a long steady run, unless the motion brings a `wake` of its own.
Derivatives are exact (reverse mode); where a model has a kink at a state, or cannot be differentiated, central differences stand in: at a
kink the mean of the slopes on both sides. Beyond the range of its training a learned model holds its inputs still: its share of the slope
is 0 there. Source: Rivera (1995), section 2.4 (gain matrix of a trained network, after Sorensen 1993); physical units and grids are ours.
"""

from dataclasses import dataclass, replace
from typing import Any, final

import torch
from torch import Tensor
from torch.func import jacrev

from nnhydro.errors import ModelError, require
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion

INPUTS = ("q", "qd", "qdd", "u0", "du0")
UNITS = {"q": "N m/rad", "qd": "N m s/rad", "qdd": "kg m^2", "u0": "N s", "du0": "kg m"}
STEP = 1e-5  # rad, rad/s, ...: of the differences; far above round-off, far below what any input is known to


@final
@dataclass(frozen=True, eq=False)
class Gains:
    """Torques (n, joints) N m and their derivatives at n states; the last axis of q, qd and qdd is the joint that moves."""

    tau: Tensor  # (n, joints) N m
    q: Tensor  # (n, joints, links) N m/rad
    qd: Tensor  # (n, joints, links) N m s/rad
    qdd: Tensor  # (n, joints, links) kg m^2
    u0: Tensor  # (n, joints) N s
    du0: Tensor  # (n, joints) kg m

    def of_joint(self, name: str, joint: int) -> Tensor:
        """Return d tau_j / d `name`_j (n,) of the joint j (from 0); `name` is q, qd or qdd."""
        found: Tensor = getattr(self, name)[:, joint, joint]
        return found

    def document(self) -> dict[str, Any]:
        """Return the matrices as lists, one entry a state."""
        return {"tau_Nm": self.tau.tolist(), **{f"d_tau_d_{name}": getattr(self, name).tolist() for name in INPUTS}}


def _columns(motion: Motion) -> tuple[Tensor, ...]:
    return motion.q, motion.qd, motion.qdd, motion.u0, motion.du0


def _displace(motion: Motion, columns: tuple[Tensor, ...]) -> Motion:
    q, qd, qdd, u0, du0 = columns
    return replace(motion, q=q, qd=qd, qdd=qdd, u0=u0, du0=du0)


def _exact(model: TorqueModel, motion: Motion) -> list[Tensor]:
    """Derivatives by reverse mode: rows are independent, so the gradient of their sum holds each row's own. NaN at kinks."""

    def total(*columns: Tensor) -> Tensor:
        return model.torque(_displace(motion, columns)).sum(dim=0)

    found = jacrev(total, argnums=tuple(range(len(INPUTS))))(*_columns(motion))
    return [slope.transpose(0, 1).detach() for slope in found]


def differences(model: TorqueModel, motion: Motion, step: float = STEP) -> list[Tensor]:
    """Return the derivatives of `INPUTS` by central differences, (n, joints, links) or (n, joints) each; needs only torques."""
    columns = _columns(motion)
    found = []
    for number, column in enumerate(columns):
        slopes = []
        for place in range(column.shape[1] if column.dim() == 2 else 1):
            shift = torch.zeros_like(column)
            shift[(slice(None), place) if column.dim() == 2 else slice(None)] = step
            ahead, behind = (model.torque(_displace(motion, (*columns[:number], column + sign * shift, *columns[number + 1:])))
                             for sign in (1, -1))
            slopes.append((ahead - behind) / (2 * step))
        found.append(torch.stack(slopes, dim=2) if column.dim() == 2 else slopes[0])
    return found


def gain_matrix(model: TorqueModel, motion: Motion) -> Gains:
    """Return the gains of `model` at every row of `motion`, whose rows are states of their own (`Motion.at`).

    Raises ModelError for a run in time order: there a torque depends on all rows before.
    """
    require(motion.steady, "gains need states, not a run: make the motion with Motion.at(q, qd, qdd, u0, du0)", ModelError)
    require(motion.q.shape[1] == model.arm.n_links,
            f"the states have {motion.q.shape[1]} joint(s), the model's arm has {model.arm.n_links}", ModelError)
    tau = model.torque(motion).detach()
    try:
        slopes = _exact(model, motion)
    except RuntimeError:  # a part of the model computes outside torch
        return Gains(tau, *differences(model, motion))
    if not all(bool(slope.isfinite().all()) for slope in slopes):
        slopes = [torch.where(slope.isfinite(), slope, kink) for slope, kink in zip(slopes, differences(model, motion), strict=True)]
    return Gains(tau, *slopes)
