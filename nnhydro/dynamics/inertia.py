"""Acceleration from torque: at once where the torque is affine in the acceleration, by Newton's method where a model was learned.

    affine    tau = M qdd + h,       column k of M: torque at qdd = e_k, minus h            qdd = M^-1 (tau - h)
    learned   M_jk(a) = [tau_j(a_k e_k) - tau_j(-a_k e_k)] / 2 a_k          effective inertia over accelerations of the size a_k
              d tau_j / d qdd_k at an acceleration that is asked for (the same over a small step)

A learned torque has kinks at rest, where scales with |qdd| begin: its slope there says little of the inertia over a motion.
A torque whose slopes have a positive definite symmetric part everywhere is monotone, so that one acceleration alone gives it. Where it has
not, several accelerations may give the same torque.

    step      the classical Runge-Kutta method of fourth order in (q, qd)

A step of Newton's that does not bring the torque closer is halved. Source: Kutta (1901).
"""

from collections.abc import Callable
from typing import Final, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.errors import ModelError, require

Array = NDArray[np.float64]
X = TypeVar("X", Tensor, Array)
TorqueOf = Callable[[Tensor], Tensor]  # accelerations (rows, k, joints) at k of each state -> torques (rows, k, joints)
STEP: Final = 1e-4  # rad/s^2 of the differences: exact to 1e-8 where the torque is smooth
REACHES: Final = (STEP, 1e-2, 1.0)  # rad/s^2, by turns: a short difference misleads near a kink
CLOSE: Final = 1e-12  # of the largest torque of the state, beside 1e-12 N m
ROUNDS, HALVINGS = 40, 12
SAME: Final = 1e-9
NEAR_REST: Final = 1e-3  # rad/s^2: beside the kinks at rest
FASTEST: Final = 1e7  # rad/s^2: there a difference over 1e-2 is lost in the rounding of the torque
HUGE: Final = 1e9  # N m: there what a unit of acceleration adds is
TOO_FAST: Final = ("the acceleration becomes {}: a torque or a rate is too large for the arm, or the step in time too long: check their "
                   "units (N m, rad/s, s), and shorten dt")


def mass_and_bias(torque: TorqueOf, like: Tensor) -> tuple[Tensor, Tensor]:
    """Return M (m, joints, joints) kg m^2 and h (m, joints) N m of a torque that is affine in the acceleration; `like` (m, joints)."""
    m, n = like.shape
    unit = torch.cat([torch.zeros(1, n, dtype=torch.float64), torch.eye(n, dtype=torch.float64)])
    found = torque(unit.expand(m, n + 1, n))
    bias = found[:, 0]
    return (found[:, 1:] - bias[:, None, :]).transpose(1, 2), bias


def tangent(torque: TorqueOf, qdd: Tensor, step: float | Tensor = STEP) -> Tensor:
    """Return d tau_j / d qdd_k (m, joints, joints) at `qdd` (m, joints), by central differences over `step` rad/s^2, one or (joints,)."""
    n = qdd.shape[1]
    shift = step * torch.eye(n, dtype=torch.float64)
    found = torque(qdd[:, None, :] + torch.cat([shift, -shift]))
    slopes: Tensor = (found[:, :n] - found[:, n:]) / (2 * shift.sum(dim=1)[:, None])
    return slopes.transpose(1, 2)


def least_inertia(mass: Tensor) -> Tensor:
    """Return the least eigenvalue (m,) kg m^2 of the symmetric part of M (m, joints, joints)."""
    found: Tensor = torch.linalg.eigvalsh((mass + mass.transpose(1, 2)) / 2)[:, 0]
    return found


def least_slope(torque: TorqueOf, qdd: Tensor, small: float | Tensor) -> Tensor:
    """Return the least inertia (m,) kg m^2 of the slopes at `qdd` (m, joints); below `small` also beside the kinks at rest."""
    (m, n), shift = qdd.shape, STEP * torch.eye(qdd.shape[1], dtype=torch.float64)
    near = (qdd.abs() < small).any(dim=1, keepdim=True)
    points = torch.stack([torch.where(near, at, qdd) for at in (qdd, NEAR_REST, -NEAR_REST)], dim=1)
    found = torque((points[:, :, None, :] + torch.cat([shift, -shift])).flatten(1, 2)).reshape(3 * m, 2 * n, n)
    return least_inertia((found[:, :n] - found[:, n:]) / (2 * STEP)).reshape(m, 3).amin(dim=1)


def solve_inertia(mass: Tensor, torque: Tensor) -> Tensor:
    """Return M^-1 tau (m, joints); raises ModelError where a mass matrix is singular, or the state is too fast for numbers."""
    found: Tensor
    found, info = torch.linalg.solve_ex(mass, torque)
    if bool(info.any()) or not bool(found.isfinite().all()):
        require(float(torque.abs().max()) < HUGE, TOO_FAST.format("too large for numbers"), ModelError)  # NaN, too
        raise ModelError("the arm has no inertia that a torque could accelerate (masses 0 in arm.yaml?): give it masses")
    return found


def acceleration(torque: TorqueOf, tau: Tensor, start: Tensor) -> Tensor:
    """Return the acceleration (m, joints) at which `torque` is `tau` (m, joints), sought from `start`.

    Raises ModelError where there is none to be found.
    """
    def residual(qdd: Tensor) -> Tensor:
        """Return the torque (m, joints) N m that is missing at `qdd` (m, joints) rad/s^2."""
        return tau - torque(qdd[:, None, :])[:, 0]

    qdd, left = start, residual(start)
    goal = CLOSE * (1 + tau.abs().amax(dim=1))
    for number in range(ROUNDS):
        open_rows = left.abs().amax(dim=1) > goal
        if not bool(open_rows.any()):
            return qdd
        fastest = float(qdd.abs().max())
        require(fastest < FASTEST, TOO_FAST.format(f"{fastest:.1e} rad/s^2"), ModelError)
        step = solve_inertia(tangent(torque, qdd, REACHES[number % len(REACHES)]), left)
        share = torch.ones(len(qdd), 1, dtype=torch.float64)
        size = left.abs().amax(dim=1, keepdim=True)
        for _ in range(HALVINGS):
            after = qdd + share * step
            new = residual(after)
            worse = (new.abs().amax(dim=1, keepdim=True) >= size) & open_rows[:, None]
            if not bool(worse.any()):
                break
            share = torch.where(worse, share / 2, share)
        qdd, left = torch.where(open_rows[:, None], after, qdd), torch.where(open_rows[:, None], new, left)
    far = float((left.abs().amax(dim=1) / (1 + tau.abs().amax(dim=1))).max())
    require(far < 1e-10, f"no acceleration gives this torque in the learned model (off by {far:.1e} of it): the state lies far from its "
            "training, or its inertia is not positive there; use a physics model or the hybrid's baseline", ModelError)
    return qdd


def runge_kutta_step(acceleration: Callable[[int, X, X, X | None], X], q: X, qd: X, h: float, guess: X | None = None) -> tuple[X, X, X]:
    """Return q, qd (..., joints) `h` s later and qdd at the start, where acceleration(k, q, qd, near) is qdd k h/2 s into the step.

    `near` is the acceleration of the stage before, at the first stage `guess`: where a solver may begin.
    """
    a1 = acceleration(0, q, qd, guess)
    v2 = qd + h / 2 * a1
    a2 = acceleration(1, q + h / 2 * qd, v2, a1)
    v3 = qd + h / 2 * a2
    a3 = acceleration(1, q + h / 2 * v2, v3, a2)
    v4 = qd + h * a3
    a4 = acceleration(2, q + h * v3, v4, a3)
    return q + h / 6 * (qd + 2 * v2 + 2 * v3 + v4), qd + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4), a1
