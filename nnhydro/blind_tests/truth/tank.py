"""The whole chain of one run: water, mass, joints, drives, sensors; what the sensors would read without noise.

    joint torque  = rigid body + water + every cause at the joints
    drive angle   = link angle + what compliance or play lets through
    belt 1:1      T_1 = tau_1 - tau_2, T_2 = tau_2; the second encoder reads q_1 + q_2     (virtual work, Rivera 1995, 3-3-16)
    sensors       every cause at the sensors in turn
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nnhydro.blind_tests.truth.flow import STRIPS, frames_of, rigid_torque, water_torque
from nnhydro.blind_tests.truth.world import Array, Cause, TrueArm, TrueRun


@dataclass(frozen=True)
class TrueReading:
    """Channels at the drives, without noise: angles (as relative joint angles), rates, accelerations, torques, each (n, L)."""

    q: Array
    qd: Array
    qdd: Array
    tau: Array


def motor_torque(tau: Array, arm: TrueArm) -> Array:
    """Return the motors' torques (n, L) for joint torques (n, L)."""
    if not arm.belt:
        return tau
    return np.column_stack([tau[:, 0] - tau[:, 1], tau[:, 1]])


def plain_torque(run: TrueRun, arm: TrueArm, strips: int = STRIPS) -> Array:
    """Return joint torques (n, L) of the healthy arm: rigid body and water with constant coefficients."""
    frames = frames_of(run, arm)
    return rigid_torque(run, arm, frames) + water_torque(run, arm, strips=strips, frames=frames)


def brisk_torque(arm: TrueArm, joint: int) -> float:
    """Return the torque N m at `joint` (from 1) of the stretched healthy arm, all joints at 1.5 rad/s and speeding up at 3 rad/s2.

    It is the drive's own measure: what a stiffness or a grease is drawn against may not differ from run to run.
    """
    still, ones = np.zeros(2), np.ones((2, len(arm.links)))
    run = TrueRun("brisk", np.array([0.0, 0.01]), 0 * ones, 1.5 * ones, 3.0 * ones, still, still)
    return max(float(np.abs(plain_torque(run, arm)[0, joint - 1])), 1e-9)


def joint_torque(run: TrueRun, arm: TrueArm, causes: Sequence[Cause], plain: Array | None = None) -> Array:
    """Return joint torques (n, L) with what the causes add there; `plain` spares the water's sum where no cause changes it."""
    changes = [cause.water for cause in sorted(causes, key=lambda cause: cause.order) if cause.water is not None]
    if changes or plain is None:
        frames = frames_of(run, arm)
        plain = rigid_torque(run, arm, frames) + water_torque(run, arm, changes, frames=frames)
    tau = plain
    for cause in causes:
        if cause.load is not None:
            tau = tau + cause.load(run, tau)
    return tau


def read(run: TrueRun, arm: TrueArm, causes: Sequence[Cause] = (), plain: Array | None = None) -> TrueReading:
    """Return what the sensors read of `run`; what acts in a part of it only, as much as it acts there (one such cause at most)."""
    everything, local = _read_without_noise(run, arm, causes, plain), next((cause for cause in causes if cause.share is not None), None)
    if local is None or local.share is None:
        return everything
    w, rest = local.share(run)[:, None], _read_without_noise(run, arm, [c for c in causes if c is not local], plain)
    return TrueReading(*(w * a + (1 - w) * b for a, b in ((everything.q, rest.q), (everything.qd, rest.qd), (everything.qdd, rest.qdd),
                                                      (everything.tau, rest.tau))))


def _read_without_noise(run: TrueRun, arm: TrueArm, causes: Sequence[Cause], plain: Array | None) -> TrueReading:
    """What the sensors read of a run without noise, cause by cause."""
    tau = joint_torque(run, arm, causes, plain)
    q, qd, qdd = run.q, run.qd, run.qdd
    for cause in causes:
        if cause.drive is not None:
            slip = cause.drive(run, tau)
            rate = np.gradient(slip, run.dt, axis=0)
            q, qd, qdd = q + slip, qd + rate, qdd + np.gradient(rate, run.dt, axis=0)
        if cause.angle is not None:
            q = q + cause.angle(run, tau)
    sensed = motor_torque(tau, arm)
    for cause in causes:
        if cause.sense is not None:
            sensed = cause.sense(run, sensed)
    return TrueReading(q, qd, qdd, sensed)
