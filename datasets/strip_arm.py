"""A two-link arm in water whose strips are given forces, by brute force: shared by ns_tank and vortex_tank. Imports nothing of nnhydro.

    z_s = i y_0 + sum_j L_j exp(i phi_j) + x_s exp(i phi_i)          point x_s of link i, carriage at y_0                  [m]
    T_j = sum_s Re( conj(dz_s/dphi_j) F_s ) h_s,  tau_1 = T_1 + ... : torque at joint j by virtual work                    [N m]
    F_s = -f_s n,   f_s force of the water on a unit of span of a cylinder that moves at w_s(t) = n.v_s           [N/m]

Each link carries GAUSS strips at Gauss-Legendre points; every strip is a flow of its own (<set>/truth.py), at rest at first. Only
the velocity normal to the link moves its cylinder; flow along the link and lift, which points out of the arm's plane, load no drive. Rigid
body: two point masses a link. No law of drag or added mass stands here. Units: SI, rad; q relative angles; torques are what the drives
exert.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GAUSS = 4  # strips a link


@dataclass(frozen=True)
class Link:
    """One link as it really is."""

    length: float  # m
    diameter: float  # m
    mass: float  # kg
    com: float  # m from its joint
    inertia: float  # kg m2 about the mass centre


@dataclass(frozen=True, eq=False)
class Motion:
    """Absolute link angles phi (n, 2) rad and carriage speed u0 (n,) m/s with their derivatives at the times t (n,) s."""

    t: Array
    phi: Array
    dphi: Array
    ddphi: Array
    u0: Array
    du0: Array


@dataclass(frozen=True, eq=False)
class Points:
    """Velocity v m/s and acceleration a m/s2 (n, s) of points of link i as complex numbers; levers dz/dphi_j, (n, s) or (n, 1)."""

    v: NDArray[np.complex128]
    a: NDArray[np.complex128]
    levers: list[NDArray[np.complex128]]


def points(m: Motion, links: list[Link], i: int, x: Array) -> Points:
    """The points x (s,) m of link i, by differentiating z once and twice."""
    e = np.exp(1j * m.phi)
    reach = [np.full(1, links[j].length) for j in range(i)] + [x]
    v = 1j * m.u0[:, None] + sum(reach[j] * (1j * m.dphi[:, j] * e[:, j])[:, None] for j in range(i + 1))
    a = 1j * m.du0[:, None] + sum(reach[j] * ((1j * m.ddphi[:, j] - m.dphi[:, j] ** 2) * e[:, j])[:, None] for j in range(i + 1))
    return Points(v, a, [1j * reach[j] * e[:, j, None] for j in range(i + 1)])


def virtual_work(p: Points, force: NDArray[np.complex128]) -> Array:
    """(n, 2) N m: torque at each joint (relative angles) that supplies `force` (n, s) N."""
    absolute = np.zeros((len(p.v), 2))
    for j, lever in enumerate(p.levers):
        absolute[:, j] = (np.conj(lever) * force).real.sum(axis=1)
    return np.column_stack([absolute.sum(axis=1), absolute[:, 1]])


def rigid_torque(m: Motion, links: list[Link]) -> Array:
    """(n, 2) N m: inertia of the dry arm; half of each link's mass at com +- sqrt(I/m)."""
    total = np.zeros_like(m.phi)
    for i, link in enumerate(links):
        gyration = np.sqrt(link.inertia / link.mass)
        p = points(m, links, i, np.array([link.com - gyration, link.com + gyration]))
        total += virtual_work(p, 0.5 * link.mass * p.a)
    return total


def gauss(link: Link) -> tuple[Array, Array]:
    """Places (GAUSS,) m along the link and the length (GAUSS,) m that each stands for."""
    x, weight = np.polynomial.legendre.leggauss(GAUSS)
    return link.length * (1 + x) / 2, link.length * weight / 2


def normal_motion(m: Motion, links: list[Link], i: int) -> tuple[Array, Array]:
    """Normal velocity w (n, GAUSS) m/s of the strips of link i and its time derivative in the link's own frame."""
    p = points(m, links, i, gauss(links[i])[0])
    turn = np.exp(-1j * m.phi[:, i, None])
    along, across = (turn * p.v).real, (turn * p.v).imag
    return across, (turn * p.a).imag - m.dphi[:, i, None] * along


def strip_motions(m: Motion, links: list[Link]) -> tuple[Array, Array]:
    """Speeds and accelerations (n, 2 GAUSS) of all strips in diameters, 1/s and 1/s2, the links being of one diameter."""
    D = links[0].diameter
    assert all(link.diameter == D for link in links)
    w, dw = (np.column_stack(parts) / D for parts in zip(*(normal_motion(m, links, i) for i in range(2)), strict=True))
    return w, dw


def water_torque(m: Motion, links: list[Link], f: Array) -> Array:
    """(n, 2) N m that the drives supply against the strip forces f (n, 2 GAUSS) N/m."""
    total = np.zeros_like(m.phi)
    for i, link in enumerate(links):
        x, length = gauss(link)
        normal = 1j * np.exp(1j * m.phi[:, i, None])
        total += virtual_work(points(m, links, i, x), -f[:, i * GAUSS:(i + 1) * GAUSS] * length * normal)
    return total
