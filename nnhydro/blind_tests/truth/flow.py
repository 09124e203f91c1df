"""Water and mass along the links, by vector algebra strip after strip.

    pos = P_i + x e,   v = dP_i/dt + x phi' n - v_water,   a = d2P_i/dt2 + x (phi'' n - phi'^2 e) - a_water
    w = n.v,           dw/dt in the link's own frame = n.a - phi' e.v                      (Rivera 1995, 3-1-14)
    f = [1/2 rho C_D d |w| w + rho pi d^2/4 C_M dw/dt] n + extra                           [N/m], what the drive supplies
    tau_j = sum_s (pos - P_j) x f ds                                                       [N m]

Rigid links: Newton's and Euler's equations, force m a_c and moment I phi'' of each link about every inboard joint.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nnhydro.blind_tests.truth.world import Array, TrueArm, TrueLink, TrueRun

STRIPS = 60  # a link: the sum is within 1e-4 of the integral


@dataclass(frozen=True)
class Frames:
    """Joints and axes through time: P, V, A (n, L+1, 2) of the joints and the tip; e, nrm (n, L, 2); spin, dspin (n, L)."""

    P: Array
    V: Array
    A: Array
    e: Array
    nrm: Array
    spin: Array
    dspin: Array


@dataclass(frozen=True)
class LinkFlow:
    """The strips of link `i` (from 0). `v`, `a` (n, s, 2) are relative to the water; C_D, C_M (n, s); `extra` (n, s, 2) N/m."""

    run: TrueRun
    arm: TrueArm
    frames: Frames
    i: int
    x: Array  # (s,) m from the link's joint
    pos: Array  # (n, s, 2) m, seen from the carriage's start
    v: Array
    a: Array
    C_D: Array
    C_M: Array
    extra: Array

    @property
    def link(self) -> TrueLink:
        """The link itself."""
        return self.arm.links[self.i]

    @property
    def e(self) -> Array:
        """Axis (n, 1, 2)."""
        return self.frames.e[:, None, self.i]

    @property
    def nrm(self) -> Array:
        """Normal (n, 1, 2)."""
        return self.frames.nrm[:, None, self.i]

    @property
    def w(self) -> Array:
        """Normal speed through the water (n, s) m/s."""
        return dot(self.v, self.nrm)

    @property
    def u(self) -> Array:
        """Axial speed through the water (n, s) m/s."""
        return dot(self.v, self.e)

    @property
    def dw(self) -> Array:
        """Derivative of w in the link's own frame (n, s) m/s2."""
        return dot(self.a, self.nrm) - self.frames.spin[:, None, self.i] * self.u

    @property
    def drag(self) -> Array:
        """Normal drag (n, s) N/m."""
        w = self.w
        return 0.5 * self.arm.rho * self.link.diameter * self.C_D * np.abs(w) * w

    @property
    def section(self) -> float:
        """Mass of displaced water a metre, kg/m."""
        return self.arm.rho * np.pi * self.link.diameter**2 / 4

    def times(self, factor: Array | float) -> LinkFlow:
        """Return the flow with C_D multiplied."""
        return replace(self, C_D=self.C_D * factor)

    def with_normal_load(self, normal: Array) -> LinkFlow:
        """Return the flow with a further normal load (n, s) N/m."""
        return replace(self, extra=self.extra + vectors(normal, self.nrm))


WaterChange = Callable[[LinkFlow], LinkFlow]


def frames_of(run: TrueRun, arm: TrueArm) -> Frames:
    """Return joints and axes of `arm` during `run`."""
    n, L = run.q.shape
    phi, spin, dspin = (np.cumsum(x, axis=1) for x in (run.q, run.qd, run.qdd))
    e = np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    nrm = np.stack([-np.sin(phi), np.cos(phi)], axis=-1)
    P, V, A = (np.zeros((n, L + 1, 2)) for _ in range(3))
    P[:, 0, 1] = run.way + np.concatenate([[0.0], np.cumsum(0.5 * (run.u0[1:] + run.u0[:-1]) * np.diff(run.t))])
    V[:, 0, 1], A[:, 0, 1] = run.u0, run.du0
    for i, link in enumerate(arm.links):
        turn, axis, side = spin[:, i, None], e[:, i], nrm[:, i]
        P[:, i + 1] = P[:, i] + link.length * axis
        V[:, i + 1] = V[:, i] + link.length * turn * side
        A[:, i + 1] = A[:, i] + link.length * (dspin[:, i, None] * side - turn**2 * axis)
    return Frames(P, V, A, e, nrm, spin, dspin)


def strips_of(run: TrueRun, arm: TrueArm, frames: Frames, i: int, strips: int = STRIPS) -> LinkFlow:
    """Return the strips of link `i` in still water with constant coefficients."""
    link = arm.links[i]
    x = (np.arange(strips) + 0.5) * link.length / strips
    shape, turn, dturn = (len(frames.spin), strips), frames.spin[:, i, None], frames.dspin[:, i, None]
    pos, v, a = (np.empty((*shape, 2)) for _ in range(3))
    for k in range(2):  # X and Y
        e, side = frames.e[:, i, k, None], frames.nrm[:, i, k, None]
        pos[..., k] = frames.P[:, i, k, None] + x * e
        v[..., k] = frames.V[:, i, k, None] + x * turn * side
        a[..., k] = frames.A[:, i, k, None] + x * (dturn * side - turn**2 * e)
    return LinkFlow(run, arm, frames, i, x, pos, v, a, np.full(shape, link.C_D), np.full(shape, link.C_M), np.zeros((*shape, 2)))


def dot(a: Array, b: Array) -> Array:
    """Return a . b of plane vectors (..., 2), a component at a time: numpy is slow along an axis of two."""
    along: Array = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]
    return along


def vectors(amount: Array, direction: Array) -> Array:
    """Return plane vectors (..., 2) of `amount` (...) along `direction` (..., 2)."""
    return np.stack([amount * direction[..., 0], amount * direction[..., 1]], axis=-1)


def cross(a: Array, b: Array) -> Array:
    """Return the Z component of a x b."""
    turn: Array = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return turn


def moments(frames: Frames, i: int, pos: Array, force: Array) -> Array:
    """Return (n, L) N m about every joint up to link `i` of forces (n, s, 2) N at `pos`."""
    tau = np.zeros(frames.spin.shape)
    for j in range(i + 1):
        x, y = (pos[..., k] - frames.P[:, j, k, None] for k in range(2))
        tau[:, j] = (x * force[..., 1] - y * force[..., 0]).sum(axis=1)
    return tau


def water_torque(run: TrueRun, arm: TrueArm, changes: Sequence[WaterChange] = (), strips: int = STRIPS,
                 frames: Frames | None = None) -> Array:
    """Return (n, L) N m that the joints supply against the water; `changes` are applied to each link's flow in turn."""
    frames, tau = frames or frames_of(run, arm), np.zeros(run.q.shape)
    for i in range(len(arm.links)):
        flow = strips_of(run, arm, frames, i, strips)
        for change in changes:
            flow = change(flow)
        normal = flow.drag + flow.section * flow.C_M * flow.dw
        force = (vectors(normal, flow.nrm) + flow.extra) * (flow.link.length / strips)
        tau += moments(frames, i, flow.pos, force)
    return tau


def rigid_torque(run: TrueRun, arm: TrueArm, frames: Frames | None = None) -> Array:
    """Return (n, L) N m: inertia of the dry links and of the moving carriage."""
    frames, tau = frames or frames_of(run, arm), np.zeros(run.q.shape)
    for i, link in enumerate(arm.links):
        axis, side, turn = frames.e[:, i], frames.nrm[:, i], frames.spin[:, i, None]
        centre = frames.P[:, i] + link.com * axis
        force = link.mass * (frames.A[:, i] + link.com * (frames.dspin[:, i, None] * side - turn**2 * axis))
        tau += moments(frames, i, centre[:, None], force[:, None])
        tau[:, : i + 1] += link.inertia * frames.dspin[:, i, None]
    return tau
