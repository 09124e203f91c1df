"""Hidden causes under the arm: a compliant mount.

    flexible_mount  y'' + 2 zeta omega y' + omega^2 y = -F_Y / M - (1 - m / M) du0

F_Y is the force that the hub supplies along the tow, to the arm as if it did not sway; m the links' mass, which M counts.
The arm's torque is that of an arm whose hub moves with u0 + y'.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nnhydro.blind_tests.truth.flow import frames_of, strips_of, vectors
from nnhydro.blind_tests.truth.registry import hides
from nnhydro.blind_tests.truth.tank import plain_torque
from nnhydro.blind_tests.truth.world import Array, Cause, Draft, Generator, TrueArm, TrueRun


def hub_force(run: TrueRun, arm: TrueArm) -> Array:
    """Return the force (n, 2) N that the hub supplies: the links' inertia and the water's loads."""
    frames, force = frames_of(run, arm), np.zeros((len(run.t), 2))
    for i, link in enumerate(arm.links):
        side, turn = frames.nrm[:, i], frames.spin[:, i, None]
        force += link.mass * (frames.A[:, i] + link.com * (frames.dspin[:, i, None] * side - turn**2 * frames.e[:, i]))
        flow = strips_of(run, arm, frames, i)
        normal = flow.drag + flow.section * flow.C_M * flow.dw
        force += vectors(normal, flow.nrm).sum(axis=1) * link.length / len(flow.x)
    return force


@hides("flexible_mount", two_links=True, by_name=True)
def flexible_mount(rng: Generator, arm: TrueArm) -> Draft:
    """Draw how fast the mount sways, and how soon it comes to rest."""
    from scipy.signal import lsim

    links = sum(link.mass for link in arm.links)
    omega, zeta = 2 * np.pi * float(rng.uniform(1.2, 3.0)), float(rng.uniform(0.03, 0.1))

    def make(a: float) -> Cause:
        """Return the cause whose mobility is `a` 1/kg."""
        def load(run: TrueRun, tau: Array) -> Array:
            """Return the extra joint torques (n, joints) N m."""
            push = -a * hub_force(run, arm)[:, 1] - max(1 - a * links, 0.0) * run.du0
            even = np.linspace(0.0, run.t[-1] - run.t[0], len(run.t))
            states = np.array([[0.0, 1.0], [-(omega**2), -2 * zeta * omega]])
            _, _, y = lsim((states, [[0.0], [1.0]], np.eye(2), np.zeros((2, 1))), push, even)
            speed = np.asarray(y)[:, 1]
            change = push + np.asarray(y) @ states[1]
            return plain_torque(replace(run, u0=run.u0 + speed, du0=run.du0 + change), arm) - plain_torque(run, arm)
        values = {"mobility": (a, "1/kg"), "frequency": (omega / 2 / np.pi, "Hz"), "damping": (zeta, "1")}
        return Cause("flexible_mount", None, "plain", "the mount bends under the arm", values, load=load)
    return Draft(make, 1e-4, 0.3)
