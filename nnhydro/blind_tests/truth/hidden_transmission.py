"""Hidden causes between drive and link: compliance, play, teeth. The encoder sits on the drive's side.

    joint_elasticity  c d delta/dt + K delta = tau (plain) or K (delta + delta^3 / delta0^2) (other, stiffens), exact steps
    backlash          c d delta/dt + K max(|delta| - gap/2, 0) sign(delta) = tau; K and c are the drive's, the same in every run
    torque_ripple     a (cos(N q + p) + 0.3 cos(2 N q + p2)) (plain), growing with the load (other)

The link moves as commanded; the drive runs ahead of it by delta, so what the encoder shows is not what the water feels.
"""

from __future__ import annotations

import numpy as np

from nnhydro.blind_tests.truth.memory import follow
from nnhydro.blind_tests.truth.registry import draw_joint, hides
from nnhydro.blind_tests.truth.tank import brisk_torque
from nnhydro.blind_tests.truth.world import Array, Cause, Draft, Generator, TrueArm, TrueRun, on_joint


def stiff_twist(delta: Array, d0: float) -> Array:
    """Return the real root y (n,) of y + y^3 / d0^2 = delta: 2/sqrt(3) d0 sinh(asinh(3 sqrt(3)/2 delta/d0) / 3)."""
    y: Array = 2 / np.sqrt(3) * d0 * np.sinh(np.arcsinh(1.5 * np.sqrt(3) * delta / d0) / 3)
    return y


@hides("joint_elasticity", no_belt=True)
def joint_elasticity(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a soft drive; its size is the compliance 1/K in rad/(N m)."""
    joint, T, stiffens = draw_joint(rng, arm), rng.uniform(0.004, 0.012), bool(rng.random() < 0.4)
    brisk = brisk_torque(arm, joint)

    def make(a: float) -> Cause:
        """Return the cause whose stiffness is `1 / a` N m/rad."""
        def drive(run: TrueRun, tau: Array) -> Array:
            """Return the angles (n, joints) rad of the drives against the links."""
            delta = follow(tau[:, joint - 1], run.dt, T) * a
            if stiffens:
                delta = stiff_twist(delta, 1.5 * a * brisk)
            return on_joint(delta, joint, tau.shape[1])
        return Cause("joint_elasticity", joint, "other" if stiffens else "plain", "the drive is compliant",
                     {"stiffness": (1 / a, "N m/rad")}, drive=drive)
    return Draft(make, 2e-5, 0.08)


def play(tau: Array, dt: float, gap: float, K: float, c: float) -> Array:
    """Return delta (n,) rad of a drive with a gap, by backward Euler, whose step has a closed form on each side of the gap."""
    delta, result = 0.0, np.zeros(len(tau))
    for k in range(len(tau)):
        free = delta + dt * tau[k] / c
        if abs(free) > gap / 2:
            edge = np.sign(free) * gap / 2
            free = edge + (free - edge) / (1 + dt * K / c)
        delta = float(free)
        result[k] = delta
    return result


@hides("backlash", no_belt=True)
def backlash(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a drive with play; its size is the gap in rad."""
    joint, c = draw_joint(rng, arm), rng.uniform(0.5, 1.5)
    size = brisk_torque(arm, joint)

    def make(a: float) -> Cause:
        """Return the cause whose gap is `a` rad."""
        def drive(run: TrueRun, tau: Array) -> Array:
            """Return the angles (n, joints) rad of the drives against the links."""
            carried = tau[:, joint - 1]
            fine = np.repeat(carried, 4)
            delta = play(fine, run.dt / 4, a, size / 0.002, c * size * 0.1 / a)[3::4]
            return on_joint(delta, joint, tau.shape[1])
        return Cause("backlash", joint, "plain", "a gap in the drive", {"gap": (a, "rad")}, drive=drive)
    return Draft(make, 5e-4, 0.15)


@hides("torque_ripple", no_belt=True)
def torque_ripple(rng: Generator, arm: TrueArm) -> Draft:
    """Draw teeth and phases."""
    joint, N, loaded = draw_joint(rng, arm), int(rng.integers(6, 25)), bool(rng.random() < 0.4)
    p, p2 = rng.uniform(0, 2 * np.pi, 2)
    usual = 0.4 * brisk_torque(arm, joint)

    def make(a: float) -> Cause:
        """Return the cause whose amplitude is `a` N m."""
        def load(run: TrueRun, tau: Array) -> Array:
            """Return the extra joint torques (n, joints) N m."""
            q, carried = run.q[:, joint - 1], tau[:, joint - 1]
            wave = a * (np.cos(N * q + p) + 0.3 * np.cos(2 * N * q + p2))
            if loaded:
                wave = wave * (0.6 + 0.4 * np.abs(carried) / usual)
            return on_joint(wave, joint, tau.shape[1])
        return Cause("torque_ripple", joint, "other" if loaded else "plain", "torque periodic in the joint's angle",
                     {"amplitude": (a, "N m"), "per_turn": (float(N), "1")}, load=load)
    return Draft(make, 1e-4, 2.0)
