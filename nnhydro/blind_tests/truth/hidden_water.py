"""Hidden causes in the water itself: a current, a wave.

    ambient_current  v_water = a (cos, sin)(angle) everywhere (plain) or (1 + 0.3 tanh(X / reach)) times that (other)
    wave_orbital     v_water = a cos(k d.r - omega t + phase) d, omega^2 = g k; its phase is the run's own. The water's acceleration is
                     that of its particles, at a fixed place, not the one that the moving strip meets, and pushes with the
                     displaced mass besides: -rho A dv_water/dt. Other: with 0.25 of the second harmonic
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nnhydro.blind_tests.truth.flow import LinkFlow, vectors
from nnhydro.blind_tests.truth.registry import hides
from nnhydro.blind_tests.truth.world import Cause, Draft, Generator, TrueArm

GRAVITY = 9.81  # m/s2


@hides("ambient_current")
def ambient_current(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a current's direction."""
    angle, sheared = float(rng.uniform(-np.pi, np.pi)), bool(rng.random() < 0.4)

    def make(a: float) -> Cause:
        """Return the cause whose speed is `a` m/s."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            stream = a * np.array([np.cos(angle), np.sin(angle)])
            if not sheared:
                return replace(flow, v=flow.v - stream)
            z = np.tanh(flow.pos[..., :1] / flow.arm.reach)
            along = flow.v + 0.0
            along[..., :] -= (1 + 0.3 * z) * stream
            rise = 0.3 * (1 - z**2) / flow.arm.reach * flow.v[..., :1]  # the strip moves into faster water
            return replace(flow, v=along, a=flow.a - rise * stream)
        return Cause("ambient_current", None, "other" if sheared else "plain", "a steady current",
                     {"speed": (a, "m/s"), "direction": (angle, "rad")}, water)
    return Draft(make, 1e-3, 0.35)


@hides("wave_orbital")
def wave_orbital(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a regular wave's period and direction."""
    f, angle, second = float(rng.uniform(0.45, 0.9)), float(rng.uniform(-np.pi, np.pi)), (0.25 if rng.random() < 0.4 else 0.0)
    omega = 2 * np.pi * f
    d = np.array([np.cos(angle), np.sin(angle)])

    def make(a: float) -> Cause:
        """Return the cause whose speed is `a` m/s."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            phase = np.random.default_rng([flow.run.seed, 13]).uniform(0, 2 * np.pi)
            k = omega**2 / GRAVITY
            arg = k * (flow.pos @ d) - omega * flow.run.t[:, None] + phase
            speed = a * (np.cos(arg) + second * np.cos(2 * arg))
            rate = a * omega * (np.sin(arg) + 2 * second * np.sin(2 * arg))
            push = vectors(flow.section * rate * (flow.nrm @ d), flow.nrm)
            return replace(flow, v=flow.v - vectors(speed, d), a=flow.a - vectors(rate, d), extra=flow.extra - push)
        return Cause("wave_orbital", None, "other" if second else "plain", "a regular wave's orbital velocity",
                     {"speed": (a, "m/s"), "frequency": (f, "Hz"), "direction": (angle, "rad")}, water, chance=True)
    return Draft(make, 1e-3, 0.3)
