"""Hidden causes at a joint that turn motion into heat.

    coulomb_friction   F sign(dq), half of it held at rest (plain); Dahl's bristle dz/dt = dq - |dq| z / z0, F z/z0 (other)
    viscous_friction   b dq (plain), b |dq|^0.85 sign(dq) (other)
    stribeck_friction  (F + dF / (1 + (dq/v)^2)) sign(dq) (plain: Lorentz, not Gauss); rate-and-state, d theta/dt = 1 - |dq| theta/l (other)
    load_friction      mu |tau| tanh(dq/0.02) (plain), mu sqrt(tau^2 + tau0^2) (other)
"""

from __future__ import annotations

import numpy as np

from nnhydro.blind_tests.truth.registry import draw_joint, hides
from nnhydro.blind_tests.truth.tank import brisk_torque
from nnhydro.blind_tests.truth.world import Array, Cause, Draft, Generator, TrueArm, TrueRun, on_joint

AT_REST = 1e-4  # rad/s


def direction(v: Array) -> Array:
    """Return the sharp sign of `v` (n,); at rest half of the last one is held, nothing before the first motion."""
    sign = np.where(np.abs(v) > AT_REST, np.sign(v), 0.0)
    last = np.maximum.accumulate(np.where(sign != 0, np.arange(len(v)), 0))
    filled: Array = np.where(sign != 0, sign, 0.5 * sign[last])
    return filled


def bristle(v: Array, dt: float, z0: float) -> Array:
    """Return Dahl's deflection z/z0 (n,) in -1..1, each step exact for constant speed."""
    z, result = 0.0, np.zeros(len(v))
    for k in range(1, len(v)):
        way = 0.5 * (v[k] + v[k - 1]) * dt / z0
        z = np.sign(way) + (z - np.sign(way)) * np.exp(-abs(way))
        result[k] = z
    return result


def state(v: Array, dt: float, way: float) -> Array:
    """Return the ageing state theta (n,) s of d theta/dt = 1 - |v| theta / way, at most 2 s."""
    theta, result = 1.0, np.ones(len(v))
    for k in range(1, len(v)):
        rate = abs(v[k]) / way
        theta = theta + dt if rate * dt < 1e-6 else 1 / rate + (theta - 1 / rate) * np.exp(-rate * dt)
        theta = min(theta, 2.0)
        result[k] = theta
    return result


@hides("coulomb_friction", no_belt=True)
def coulomb_friction(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a dry joint."""
    joint, dahl, z0 = draw_joint(rng, arm), bool(rng.random() < 0.5), rng.uniform(0.005, 0.02)

    def make(a: float) -> Cause:
        """Return the cause whose level is `a` N m."""
        def load(run: TrueRun, tau: Array) -> Array:
            """Return the extra joint torques (n, joints) N m."""
            v = run.qd[:, joint - 1]
            return on_joint(a * (bristle(v, run.dt, z0) if dahl else direction(v)), joint, tau.shape[1])
        return Cause("coulomb_friction", joint, "other" if dahl else "plain", "dry friction", {"level": (a, "N m")}, load=load)
    return Draft(make, 1e-4, 3.0)


@hides("viscous_friction", no_belt=True)
def viscous_friction(rng: Generator, arm: TrueArm) -> Draft:
    """Draw an oily joint."""
    joint, p = draw_joint(rng, arm), (0.85 if rng.random() < 0.4 else 1.0)

    def make(a: float) -> Cause:
        """Return the cause whose damping is `a` N m s/rad."""
        def load(run: TrueRun, tau: Array) -> Array:
            """Return the extra joint torques (n, joints) N m."""
            v = run.qd[:, joint - 1]
            return on_joint(a * np.sign(v) * np.abs(v) ** p, joint, tau.shape[1])
        return Cause("viscous_friction", joint, "plain" if p == 1 else "other", "friction that grows with speed",
                     {"damping": (a, "N m s/rad")}, load=load)
    return Draft(make, 1e-4, 3.0)


@hides("stribeck_friction", no_belt=True)
def stribeck_friction(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a joint that holds on at low speed."""
    joint, aged, vs, more = draw_joint(rng, arm), bool(rng.random() < 0.4), rng.uniform(0.08, 0.25), rng.uniform(1.2, 2.5)

    def make(a: float) -> Cause:
        """Return the cause whose coulomb is `a` N m."""
        def load(run: TrueRun, tau: Array) -> Array:
            """Return the extra joint torques (n, joints) N m."""
            v = run.qd[:, joint - 1]
            if aged:
                theta = state(v, run.dt, 0.1)
                level = a * (1 + 0.45 * more * np.log1p(theta * vs / 0.02))
                return on_joint(level * direction(v), joint, tau.shape[1])
            return on_joint(a * (1 + more / (1 + (v / vs) ** 2)) * direction(v), joint, tau.shape[1])
        size = {"coulomb": (a, "N m")} | ({} if aged else {"breakaway": (a * (1 + more), "N m"), "stribeck_speed": (vs, "rad/s")})
        return Cause("stribeck_friction", joint, "other" if aged else "plain", "breakaway that falls with speed", size, load=load)
    return Draft(make, 1e-4, 2.0)


@hides("load_friction", no_belt=True)
def load_friction(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a gear that loses a share of what it carries."""
    joint, tau0 = draw_joint(rng, arm), (0.3 if rng.random() < 0.4 else 0.0)
    preload = 0.4 * tau0 * brisk_torque(arm, joint)

    def make(a: float) -> Cause:
        """Return the cause whose coefficient is `a`."""
        def load(run: TrueRun, tau: Array) -> Array:
            """Return the extra joint torques (n, joints) N m."""
            carried = tau[:, joint - 1]
            level = np.sqrt(carried**2 + preload**2)
            return on_joint(a * level * np.tanh(run.qd[:, joint - 1] / 0.02), joint, tau.shape[1])
        return Cause("load_friction", joint, "other" if tau0 else "plain", "friction proportional to the load",
                     {"coefficient": (a, "1")}, load=load)
    return Draft(make, 1e-3, 0.6)
