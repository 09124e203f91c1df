"""Hidden causes that pull back: the plane is not level, a hose.

    buoyancy_tilt        sum of (net weight of a link) sin(a) along a direction of the plane, acting at each link's middle and mass centre
    umbilical_stiffness  k (q - q0) + 0.15 k (q - q0)^3 (plain) or 1.5 k tanh((q - q0)/1.5) (other)
"""

from __future__ import annotations

import numpy as np

from nnhydro.blind_tests.truth.flow import cross, frames_of
from nnhydro.blind_tests.truth.registry import draw_joint, hides
from nnhydro.blind_tests.truth.world import Array, Cause, Draft, Generator, TrueArm, TrueRun, on_joint

GRAVITY = 9.81  # m/s2


@hides("buoyancy_tilt", no_belt=True)
def buoyancy_tilt(rng: Generator, arm: TrueArm) -> Draft:
    """Draw the way the plane leans."""
    angle = float(rng.uniform(-np.pi, np.pi))

    def make(a: float) -> Cause:
        """Return the cause whose tilt is `a` rad."""
        def load(run: TrueRun, tau: Array) -> Array:
            """Return the extra joint torques (n, joints) N m."""
            F, result = frames_of(run, arm), np.zeros_like(tau)
            down = GRAVITY * np.sin(a) * np.array([np.cos(angle), np.sin(angle)])
            for i, link in enumerate(arm.links):
                wet = arm.rho * np.pi * link.diameter**2 / 4 * link.length
                for mass, x in ((link.mass, link.com), (-wet, 0.5 * link.length)):
                    place = F.P[:, i] + x * F.e[:, i]
                    for j in range(i + 1):
                        result[:, j] -= cross(place - F.P[:, j], np.broadcast_to(mass * down, place.shape))
            return result
        return Cause("buoyancy_tilt", None, "plain", "weight minus buoyancy on a tilted plane",
                     {"tilt": (a, "rad"), "direction": (angle, "rad")}, load=load)
    return Draft(make, 1e-3, 0.5)


@hides("umbilical_stiffness", no_belt=True)
def umbilical_stiffness(rng: Generator, arm: TrueArm) -> Draft:
    """Draw the joint with a hose and its free angle."""
    joint, q0, bends = draw_joint(rng, arm), float(rng.uniform(-0.5, 0.5)), bool(rng.random() < 0.4)

    def make(a: float) -> Cause:
        """Return the cause whose stiffness is `a` N m/rad."""
        def load(run: TrueRun, tau: Array) -> Array:
            """Return the extra joint torques (n, joints) N m."""
            d = run.q[:, joint - 1] - q0
            return on_joint(1.5 * a * np.tanh(d / 1.5) if bends else a * (d + 0.15 * d**3), joint, tau.shape[1])
        return Cause("umbilical_stiffness", joint, "other" if bends else "plain", "a hose pulls the joint back",
                     {"stiffness": (a, "N m/rad"), "free_angle": (q0, "rad")}, load=load)
    return Draft(make, 1e-4, 3.0)
