"""Hidden causes with mass: the water's, a rotor's, a payload's.

    added_mass     C_M, where the baseline has none
    rotor_inertia  J ddq of the joint's own gear-side rotor
    payload_mass   a point mass at the tip (plain) or a few centimetres beyond it (other)
    oscillating_mass  y'' + 2 zeta omega y' + omega^2 y = -a across the end of a link, in place of a rigid mass: force m y''
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nnhydro.blind_tests.truth.flow import LinkFlow, cross, frames_of
from nnhydro.blind_tests.truth.registry import draw_joint, hides
from nnhydro.blind_tests.truth.world import Array, Cause, Draft, Generator, TrueArm, TrueRun, on_joint


@hides("added_mass")
def added_mass(rng: Generator, arm: TrueArm) -> Draft:
    """Draw added mass for an arm whose C_M is zero otherwise."""
    def make(a: float) -> Cause:
        """Return the cause whose cm is `a`."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            return replace(flow, C_M=np.full_like(flow.C_M, a))
        return Cause("added_mass", None, "plain", "the inertia of the water", {"cm": (a, "1")}, water, order=-1)
    return Draft(make, 0.01, 1.2)


@hides("rotor_inertia", no_belt=True)
def rotor_inertia(rng: Generator, arm: TrueArm) -> Draft:
    """Draw the joint whose motor is heavy."""
    joint = draw_joint(rng, arm)
    last = arm.links[joint - 1:]
    water = sum(arm.rho * np.pi * link.diameter**2 * link.length**3 / 12 for link in last)
    moved = sum(link.inertia + link.mass * link.com**2 for link in last) + water

    def make(a: float) -> Cause:
        """Return the cause whose inertia is `a` kg m2."""
        def load(run: TrueRun, tau: Array) -> Array:
            """Return the extra joint torques (n, joints) N m."""
            return on_joint(a * run.qdd[:, joint - 1], joint, tau.shape[1])
        return Cause("rotor_inertia", joint, "plain", "a motor's rotor turns with the joint", {"inertia": (a, "kg m2")}, load=load)
    return Draft(make, 1e-3 * moved, 1.5 * moved)


@hides("payload_mass")
def payload_mass(rng: Generator, arm: TrueArm) -> Draft:
    """Draw where the payload hangs."""
    beyond = float(rng.uniform(0.02, 0.05)) if rng.random() < 0.4 else 0.0

    def make(a: float) -> Cause:
        """Return the cause whose mass is `a` kg."""
        def load(run: TrueRun, tau: Array) -> Array:
            """Return the extra joint torques (n, joints) N m."""
            F = frames_of(run, arm)
            side, turn = F.nrm[:, -1], F.spin[:, -1, None]
            place = F.P[:, -1] + beyond * F.e[:, -1]
            force = a * (F.A[:, -1] + beyond * (F.dspin[:, -1, None] * side - turn**2 * F.e[:, -1]))
            return np.column_stack([cross(place - F.P[:, j], force) for j in range(tau.shape[1])])
        return Cause("payload_mass", None, "other" if beyond else "plain", "a mass at the tip", {"mass": (a, "kg")}, load=load)
    return Draft(make, 1e-3, 0.8 * sum(link.mass for link in arm.links))


@hides("oscillating_mass", by_name=True)
def oscillating_mass(rng: Generator, arm: TrueArm) -> Draft:
    """Draw the link on which a part of the mass swings, how fast, and how soon it comes to rest."""
    from scipy.signal import lsim

    link, omega, zeta = draw_joint(rng, arm), 2 * np.pi * float(rng.uniform(0.4, 1.2)), float(rng.uniform(0.04, 0.2))

    def make(a: float) -> Cause:
        """Return the cause whose mass is `a` kg."""
        def load(run: TrueRun, tau: Array) -> Array:
            """Return the extra joint torques (n, joints) N m."""
            F = frames_of(run, arm)
            across = F.nrm[:, link - 1]
            push = -(F.A[:, link] * across).sum(axis=1)
            even = np.linspace(0.0, run.t[-1] - run.t[0], len(run.t))
            _, y, _ = lsim(([1.0, 0.0, 0.0], [1.0, 2 * zeta * omega, omega**2]), push, even)
            force = a * np.asarray(y)[:, None] * across
            return np.column_stack([cross(F.P[:, link] - F.P[:, j], force) if j < link else np.zeros(len(force))
                                    for j in range(tau.shape[1])])
        values = {"mass": (a, "kg"), "frequency": (omega / 2 / np.pi, "Hz"), "damping": (zeta, "1")}
        return Cause("oscillating_mass", link, "plain", "liquid in a tank swings on a link", values, load=load)
    return Draft(make, 1e-3, 0.5 * sum(link.mass for link in arm.links))
