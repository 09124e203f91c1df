"""A two-link arm in a tow tank, computed by brute force: the planted truth of this data set.

Everything is in absolute link angles phi_j, which are the motor angles of a 1:1 belt drive, and in complex numbers
z = X + iY, so that no closed form of a textbook is used twice:

    z_s   = sum_j L_j exp(i phi_j) + x_s exp(i phi_i)          strip s of link i, seen from the carriage     [m]
    T_j   = sum_s Re( conj(dz_s/dphi_j) F_s ) ds               torque at motor j, by virtual work          [N m]
    F_s   = f_n n + f_e e                                      what the drive supplies, a unit of length   [N/m]
    f_n   = 1/2 rho C_D d |w| w + C_M rho pi d^2/4 dw/dt,      w = n.v                                     [N/m]
    f_e   = 1/2 rho C_X d |u| u + C_A rho pi d^2/4 du/dt,      u = e.v                                     [N/m]

dw/dt is the derivative of the velocity component in the link's own frame (Rivera 1995, 3-1-14): n.a - phi' e.v.
C_D and C_M of a strip follow the state of its own wake, its distance from the tip and, on link 2, the shadow of
link 1. Rigid body: two point masses a link, which have its mass, mass centre and inertia exactly.
Units: SI, rad. Torques are those the drive exerts (LOAD). Arrays: n times, s strips, 2 joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

Array = NDArray[np.float64]

STRIPS = 60  # a link: the strip sum is then within 1e-4 of the integral
GROWTH = 0.9  # D, travel that feeds a fresh vortex pair
SHEDDING = 4.0  # D, travel that feeds the street which replaces the pair
OVERSHOOT_C_D = 1.3  # of the developed C_D: the peak from rest is 1.38 times it, after 3.7 D
OVERSHOOT_C_M = 0.6  # the same for the loss of added mass
INSTANT = 0.2  # share of the developed C_D that is there at once, before any wake
LEAST_C_D = 0.05  # of the developed C_D: the water behind never pushes a link forward
REVERSAL_SPEED = 0.01  # m/s, below it a strip has no direction of its own
TIP_LOSS, TIP_REACH = 0.5, 0.75  # share of C_D lost at the free end; its e-folding length in D
SHADOW_DEPTH, SHADOW_LENGTH = 0.7, 10.0  # share of C_D lost just behind link 1; its e-folding length in D of link 1
SHADOW_SPREAD = 0.1  # growth of the wake's soft edge per unit of distance
SHADOW_SPEED = 0.05  # m/s, below it there is no wake to be shadowed by


@dataclass(frozen=True)
class Link:
    """One link as it really is. C_D and C_M_wake belong to the developed wake, C_M to the start from rest."""

    length: float  # m
    diameter: float  # m
    mass: float  # kg
    com: float  # m from its joint
    inertia: float  # kg m2 about the mass centre
    C_D: float = 1.0
    C_M: float = 1.0
    C_M_wake: float = 0.4
    C_D_axial: float = 0.0
    C_M_axial: float = 0.0


@dataclass(frozen=True)
class Seal:
    """Friction of one joint, sign(v) (C + breakaway) + viscous v, smooth through v = 0."""

    coulomb: float  # N m
    breakaway: float  # N m above Coulomb at the first movement
    viscous: float  # N m s/rad
    stribeck_speed: float = 0.1  # rad/s
    grip_speed: float = 0.02  # rad/s, presliding of the lip

    def torque(self, v: Array) -> Array:  # N m
        level = self.coulomb + self.breakaway * np.exp(-((v / self.stribeck_speed) ** 2))
        return level * np.tanh(v / self.grip_speed) + self.viscous * v


@dataclass(frozen=True)
class Effects:
    """Which of the planted effects act; all off leaves constant coefficients and a frictionless arm."""

    wake: bool = True
    shadow: bool = True
    tip: bool = True
    friction: bool = True


@dataclass(frozen=True)
class Motion:
    """What the arm did. `developed`: the wakes were old when the recording began; else the water was still."""

    t: Array  # (n,) s, even steps
    phi: Array  # (n, 2) rad, absolute
    dphi: Array  # (n, 2) rad/s
    ddphi: Array  # (n, 2) rad/s2
    u0: Array  # (n,) m/s
    du0: Array  # (n,) m/s2
    developed: bool = False


@dataclass(frozen=True)
class Points:
    """Points of one link through time, as complex numbers."""

    z: NDArray[np.complex128]  # (n, s) m, from the carriage
    v: NDArray[np.complex128]  # (n, s) m/s, through the water
    a: NDArray[np.complex128]  # (n, s) m/s2
    levers: list[NDArray[np.complex128]]  # dz/dphi_j, each (n, s) or (n, 1)


def points(m: Motion, links: list[Link], i: int, x: Array) -> Points:
    """Positions, velocities and accelerations of the points x of link i, by differentiating z once and twice."""
    e = np.exp(1j * m.phi)
    spin = 1j * m.ddphi - m.dphi**2
    reach = [np.full(1, links[j].length) for j in range(i)] + [x]
    z = sum(reach[j] * e[:, j, None] for j in range(i + 1))
    v = 1j * m.u0[:, None] + sum(reach[j] * (1j * m.dphi[:, j] * e[:, j])[:, None] for j in range(i + 1))
    a = 1j * m.du0[:, None] + sum(reach[j] * (spin[:, j] * e[:, j])[:, None] for j in range(i + 1))
    return Points(z, v, a, [1j * reach[j] * e[:, j, None] for j in range(i + 1)])


def virtual_work(p: Points, force: NDArray[np.complex128]) -> Array:
    """(n, 2) N m: T_j = sum_s Re(conj(dz_s/dphi_j) F_s)."""
    torque = np.zeros((len(p.z), 2))
    for j, lever in enumerate(p.levers):
        torque[:, j] = (np.conj(lever) * force).real.sum(axis=1)
    return torque


def rigid_torque(m: Motion, links: list[Link]) -> Array:
    """(n, 2) N m: inertia of the dry arm; half of each link's mass at com +- sqrt(I/m)."""
    total = np.zeros_like(m.phi)
    for i, link in enumerate(links):
        gyration = np.sqrt(link.inertia / link.mass)
        p = points(m, links, i, np.array([link.com - gyration, link.com + gyration]))
        total += virtual_work(p, 0.5 * link.mass * p.a)
    return total


def wake_speeds(w: Array, m: Motion, diameter: float) -> tuple[Array, Array]:
    """(n, s) m/s: speeds P and S that a strip's vortex pair and its street were last fed with, signed.

        dP/ds = (w - P) / (GROWTH D),    dS/ds = (w - S) / (SHEDDING D),    ds = |w| dt

    Exact over a step of constant w. Old wakes begin at w; still water begins at 0; a strip at rest keeps its wake.
    """
    if m.developed and len(m.t) < 2:
        return w, w
    step = np.abs(w) * np.gradient(m.t)[:, None] / diameter
    speeds = []
    for memory in (GROWTH, SHEDDING):
        keep = np.exp(-step / memory)
        fed = (1.0 - keep) * w
        speed = np.empty_like(w)
        speed[0] = w[0] if m.developed else 0.0
        for k in range(1, len(w)):
            speed[k] = keep[k] * speed[k - 1] + fed[k]
        speeds.append(speed)
    return speeds[0], speeds[1]


def wake_coefficients(link: Link, w: Array, pair: Array, street: Array) -> tuple[Array, Array]:
    """(n, s) C_D |w| in m/s and C_M: both follow |P| (how much wake) and P - S (how young it is).

    From rest at constant acceleration P/w and S/w depend on s/D alone, as McLain and Rock (1998) derive it. After a
    reversal the old wake runs against the strip: |P| > 0 at once, so the drag is larger than from rest.
    """
    young = (pair - street) * np.tanh(w / REVERSAL_SPEED)
    young = young / np.sqrt(w**2 + young**2 + REVERSAL_SPEED**2)  # in -1..1
    fed = INSTANT * np.abs(w) + (1.0 - INSTANT) * np.abs(pair)
    C_D_w = link.C_D * np.maximum(fed + OVERSHOOT_C_D * young * np.abs(w), LEAST_C_D * np.abs(w))
    grown = np.abs(pair) / np.sqrt(0.5 * (w**2 + pair**2) + REVERSAL_SPEED**2)
    C_M = link.C_M - (link.C_M - link.C_M_wake) * (grown + OVERSHOOT_C_M * young)
    return C_D_w, C_M


def tip_relief(link: Link, x: Array) -> Array:
    """(s,) what the free end leaves of C_D: water flows round it into the wake."""
    return 1.0 - TIP_LOSS * np.exp(-(link.length - x) / (TIP_REACH * link.diameter))


def shadow(p: Points, m: Motion, upstream: Link) -> Array:
    """(n, s) share of C_D lost in the wake of link 1: the strip looks ahead along its own motion and sees link 1.

    In link 1's frame the strip is at (xi, eta) and moves along (c, s): it meets the axis of link 1 after the
    distance -eta/s, at xi - eta c/s from the hub. That point must lie on link 1.
    """
    turn = np.exp(-1j * m.phi[:, :1])
    place, speed = p.z * turn, np.abs(p.v)
    course = p.v * turn / np.maximum(speed, 1e-9)
    ahead = -place.imag * course.imag / (course.imag**2 + 0.02)  # 0.02: a strip running along link 1 sees nothing
    meets = place.real + ahead * course.real
    edge = 0.5 * upstream.diameter + SHADOW_SPREAD * np.abs(ahead)
    inside = expit(meets / edge) * expit((upstream.length - meets) / edge)
    behind = expit((ahead - upstream.diameter) / (0.5 * upstream.diameter))
    fades = np.exp(-np.maximum(ahead, 0.0) / (SHADOW_LENGTH * upstream.diameter))
    return SHADOW_DEPTH * inside * behind * fades * speed**2 / (speed**2 + SHADOW_SPEED**2)


def link_water_torque(m: Motion, links: list[Link], i: int, rho: float, on: Effects, strips: int = STRIPS) -> Array:
    """(n, 2) N m: what the motors supply against the water on link i."""
    link = links[i]
    ds = link.length / strips
    x = (np.arange(strips) + 0.5) * ds
    p = points(m, links, i, x)
    e = np.exp(1j * m.phi[:, i, None])
    along, across = np.conj(e) * p.v, np.conj(e) * p.a
    u, w = along.real, along.imag
    dw = across.imag - m.dphi[:, i, None] * u
    du = across.real + m.dphi[:, i, None] * w
    C_D_w, C_M = link.C_D * np.abs(w), np.full_like(w, link.C_M)
    if on.wake:
        C_D_w, C_M = wake_coefficients(link, w, *wake_speeds(w, m, link.diameter))
    if on.tip and i == len(links) - 1:
        C_D_w = C_D_w * tip_relief(link, x)
    if on.shadow and i > 0:
        C_D_w = C_D_w * (1.0 - shadow(p, m, links[0]))
    drag, added = 0.5 * rho * link.diameter, rho * np.pi * link.diameter**2 / 4.0
    f_n = drag * C_D_w * w + added * C_M * dw
    f_e = drag * link.C_D_axial * np.abs(u) * u + added * link.C_M_axial * du
    return virtual_work(p, (f_e + 1j * f_n) * e * ds)


def friction_torque(m: Motion, seals: list[Seal]) -> Array:
    """(n, 2) N m: the elbow seal turns with link 2 against link 1, so motor 1 feels it with the other sign."""
    shoulder, elbow = seals[0].torque(m.dphi[:, 0]), seals[1].torque(m.dphi[:, 1] - m.dphi[:, 0])
    return np.stack([shoulder - elbow, elbow], axis=1)


def motor_torque(m: Motion, links: list[Link], seals: list[Seal], rho: float, on: Effects = Effects()) -> Array:
    """(n, 2) N m: T_1, T_2 on the output side of the gears, noise-free and unfiltered."""
    total = rigid_torque(m, links)
    for i in range(len(links)):
        total = total + link_water_torque(m, links, i, rho, on)
    return total + friction_torque(m, seals) if on.friction else total
