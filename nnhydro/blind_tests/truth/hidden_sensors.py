"""Hidden causes in the sensors: torque, time, angle.

    torque_bias        + a                                        torque_gain   (1 + a) tau; other: with 0.2 a tau |tau|/tau_0
    torque_drift       a (1 - exp(-T/T0)) over the time of day (plain, warming up) or a slow random walk (other)
    torque_crosstalk   + a tau of the other joint
    torque_saturation  clip at the level 0.6 tau_0 / a (plain) or level tanh(tau/level) (other), tau_0 of the arm's size
    sensor_timing      tau(t - a), by cubic interpolation (plain), or a first-order lag of a (other)
    encoder_offset     q + a (plain), q + a (1 + 0.1 sin q) (other)
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from nnhydro.blind_tests.truth.memory import follow, wander
from nnhydro.blind_tests.truth.registry import draw_joint, hides
from nnhydro.blind_tests.truth.tank import brisk_torque
from nnhydro.blind_tests.truth.world import Array, Cause, Draft, Generator, TrueArm, TrueRun, on_joint


@hides("torque_bias")
def torque_bias(rng: Generator, arm: TrueArm) -> Draft:
    """Draw an offset."""
    joint, side = draw_joint(rng, arm), float(rng.choice([-1.0, 1.0]))

    def make(a: float) -> Cause:
        """Return the cause whose bias is `side * a` N m."""
        def sense(run: TrueRun, tau: Array) -> Array:
            """Return what the torque sensors read, (n, joints) N m."""
            return tau + on_joint(np.full(len(tau), side * a), joint, tau.shape[1])
        return Cause("torque_bias", joint, "plain", "the torque sensor has an offset", {"bias": (side * a, "N m")}, sense=sense)
    return Draft(make, 1e-4, 2.0)


@hides("torque_gain")
def torque_gain(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a scale error."""
    joint, side, bent = draw_joint(rng, arm), float(rng.choice([-1.0, 1.0])), (0.2 if rng.random() < 0.3 else 0.0)
    brisk = brisk_torque(arm, joint)

    def make(a: float) -> Cause:
        """Return the cause whose gain is `1 + side * a`."""
        def sense(run: TrueRun, tau: Array) -> Array:
            """Return what the torque sensors read, (n, joints) N m."""
            read = tau[:, joint - 1]
            more = side * a * read * (1 + bent * np.abs(read) / brisk)
            return tau + on_joint(more, joint, tau.shape[1])
        return Cause("torque_gain", joint, "other" if bent else "plain", "the torque sensor has a wrong scale",
                     {"gain": (1 + side * a, "1")}, sense=sense)
    return Draft(make, 2e-3, 0.6)


@hides("torque_drift")
def torque_drift(rng: Generator, arm: TrueArm) -> Draft:
    """Draw how the zero of a sensor moves over the campaign."""
    joint, side, walks = draw_joint(rng, arm), float(rng.choice([-1.0, 1.0])), bool(rng.random() < 0.5)
    T0, seed = rng.uniform(900.0, 2400.0), int(rng.integers(2**31))

    def make(a: float) -> Cause:
        """Return the cause whose drift is `side * a` N m."""
        def sense(run: TrueRun, tau: Array) -> Array:
            """Return what the torque sensors read, (n, joints) N m."""
            T = run.clock - 9 * 3600.0
            path = wander(np.random.default_rng(seed), T, 700.0) if walks else 1 - np.exp(-T / T0)
            return tau + on_joint(side * a * path, joint, tau.shape[1])
        return Cause("torque_drift", joint, "other" if walks else "plain", "the torque sensor's zero moves", {"drift": (side * a, "N m")},
                     sense=sense)
    return Draft(make, 1e-4, 3.0)


@hides("torque_crosstalk", two_links=True)
def torque_crosstalk(rng: Generator, arm: TrueArm) -> Draft:
    """Draw which channel leaks into which."""
    joint, side = draw_joint(rng, arm), float(rng.choice([-1.0, 1.0]))

    def make(a: float) -> Cause:
        """Return the cause whose leak is `side * a`."""
        def sense(run: TrueRun, tau: Array) -> Array:
            """Return what the torque sensors read, (n, joints) N m."""
            return tau + on_joint(side * a * tau[:, 2 - joint], joint, tau.shape[1])
        return Cause("torque_crosstalk", joint, "plain", "the other joint's torque leaks in", {"leak": (side * a, "1")}, sense=sense)
    return Draft(make, 2e-3, 0.6)


@hides("torque_saturation")
def torque_saturation(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a clipping channel; the level is a torque, set by the arm's own size."""
    joint, soft = draw_joint(rng, arm), bool(rng.random() < 0.3)
    scale = 0.25 * arm.rho * arm.links[-1].diameter * arm.reach**2 * 1.4**2 / 2  # N m, near the largest torque of a campaign
    scale *= 1.0 if joint == 1 else (arm.links[-1].length / arm.reach) ** 2

    def make(a: float) -> Cause:
        """Return the cause at the size `a`."""
        level = scale * 0.6 / a

        def sense(run: TrueRun, tau: Array) -> Array:
            """Return what the torque sensors read, (n, joints) N m."""
            result = tau.copy()
            read = tau[:, joint - 1]
            result[:, joint - 1] = level * np.tanh(read / level) if soft else read.clip(-level, level)
            return result
        return Cause("torque_saturation", joint, "other" if soft else "plain", "the torque channel clips",
                     {"level": (level, "N m")}, sense=sense)
    return Draft(make, 0.1, 20.0)


@hides("sensor_timing")
def sensor_timing(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a torque channel that comes late."""
    lag = bool(rng.random() < 0.4)

    def make(a: float) -> Cause:
        """Return the cause whose delay is `a` s."""
        def sense(run: TrueRun, tau: Array) -> Array:
            """Return what the torque sensors read, (n, joints) N m."""
            if lag:
                return follow(tau, run.dt, a)
            then = np.maximum(run.t - a, run.t[0])
            late: Array = CubicSpline(run.t, tau)(then)
            return late
        return Cause("sensor_timing", None, "other" if lag else "plain", "torque comes later than the angles",
                     {"delay": (a, "s")}, sense=sense)
    return Draft(make, 5e-4, 0.1)


@hides("encoder_offset", no_belt=True)
def encoder_offset(rng: Generator, arm: TrueArm) -> Draft:
    """Draw an angle channel with a constant error."""
    joint, side, bent = draw_joint(rng, arm), float(rng.choice([-1.0, 1.0])), (0.1 if rng.random() < 0.4 else 0.0)

    def make(a: float) -> Cause:
        """Return the cause whose offset is `side * a` rad."""
        def angle(run: TrueRun, tau: Array) -> Array:
            """Return what the encoders add, (n, joints) rad."""
            return on_joint(side * a * (1 + bent * np.sin(run.q[:, joint - 1])), joint, tau.shape[1])
        return Cause("encoder_offset", joint, "other" if bent else "plain", "an angle is read with an error", {"offset": (side * a, "rad")},
                     angle=angle)
    return Draft(make, 1e-3, 0.4)
