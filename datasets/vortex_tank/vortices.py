"""Discrete vortices behind circular cylinders that move along a line in still water, many strips at once. Imports nothing of nnhydro.

    dz_k/dt = conj( -u (1 - a^2/z_k^2) + sum_l i G_l/(2 pi) [ 1/(z_k - z_l) - 1/(z_k - a^2/conj z_l) ] )       frame of the cylinder
    dG/dt   = 1/2 |v_s| v_s                         fed at the separation points, v_s the speed along the wall there
    F/rho   = -pi a^2 du/dt - d/dt sum_k G_k y_k (1 - a^2/|z_k|^2)                                          a unit of span

The wake stays symmetric: the vortices of the lower half are mirror images of those of the upper half, which alone are stored. The boundary
layer leaves the wall at the angle SEPARATION behind the front, whichever side that is; what it feeds is one vortex until the flow has
gone on by RELEASE diameters, then another. A share of the circulation is lost at the wall, more by cancellation as the vortex ages.
Lengths in diameters (a = 1/2). Sources: Sarpkaya & Shoaff (1979), AIAA J. 17, 1193, and McLain & Rock (1998), section 2 (potential,
impulse, feeding); Kiya & Arie (1977), J. Fluid Mech. 82, 223 (loss of circulation). No law of drag or added mass stands here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

A = 0.5  # radius in diameters
SEPARATION = np.radians(98.0)  # from the front
BIRTH = 0.06  # diameters from the wall
CORE = 0.09  # diameters: inside it a vortex turns like a solid
RELEASE = 0.18  # diameters that the flow goes by while one vortex is fed
SURVIVES = 0.80  # share of the circulation that the wall does not cancel
AGEING = 0.055  # share of it lost a diameter that the strip travels
SLOTS = 56  # vortices remembered a strip


def induced(at: Complex, z: Complex, g: Array) -> Complex:
    """conj of the velocity (B, m) at the points `at` (B, m) due to vortices z, g (B, n), their images and mirror images."""
    image = A**2 / np.conj(z)
    places = np.concatenate([z, np.conj(z), image, np.conj(image)], axis=1)
    strengths = np.concatenate([g, -g, -g, g], axis=1)
    x, y = at.real[:, :, None] - places.real[:, None, :], at.imag[:, :, None] - places.imag[:, None, :]
    weight = strengths[:, None, :] / (x * x + y * y + CORE**2)
    return (-(weight * y).sum(axis=2) - 1j * (weight * x).sum(axis=2)) / (2 * np.pi)


def velocity(at: Complex, z: Complex, g: Array, u: Array) -> Complex:
    """Velocity (B, m) of the water past cylinders that move at u (B,)."""
    stream = -u[:, None] * (1 - A**2 / at**2)
    return np.conj(stream + induced(at, z, g))


def impulse(z: Complex, g: Array) -> Array:
    """(B,) of both halves along the way, over rho."""
    return 2 * (g * z.imag * (1 - A**2 / np.abs(z) ** 2)).sum(axis=1)


def forces(t: Array, u: Array, du: Array) -> Array:
    """F (n, B) over rho D^3 [1/s^2] at the times t (n,) s of B strips with speeds u and accelerations du (n, B) in D/s, D/s^2."""
    n, B = u.shape
    z, g = np.full((B, SLOTS), 50.0 + 50.0j), np.zeros((B, SLOTS))
    fed, gone, heading = np.zeros(B, dtype=int), np.full(B, np.inf), np.zeros(B)
    rows, found = np.arange(B), np.zeros((n, B))
    found[0] = -np.pi * A**2 * du[0]
    for k in range(1, n):
        dt, now = t[k] - t[k - 1], (u[k] + u[k - 1]) / 2
        side = np.where(now == 0, heading, np.sign(now))  # the front lies where the strip goes
        angle = np.where(side >= 0, SEPARATION, np.pi - SEPARATION)
        wall = A * np.exp(1j * angle)
        slip = velocity(wall[:, None], z, g, now)[:, 0]
        along = (slip * np.conj(1j * wall / A)).real  # counter-clockwise
        gone = gone + np.abs(along) * dt
        anew = (gone > RELEASE) | (side != heading)
        fed = np.where(anew, (fed + 1) % SLOTS, fed)
        heading, gone = side, np.where(anew, 0.0, gone)
        z[rows, fed] = np.where(anew, wall * (1 + BIRTH / A), z[rows, fed])
        g[rows, fed] = np.where(anew, 0.0, g[rows, fed])
        g = g * np.exp(-AGEING * np.abs(now)[:, None] * dt)
        aged = impulse(z, g)  # what cancels takes its impulse along without loading the cylinder
        v = velocity(z, z, g, now)
        middle = z + v * dt / 2
        v = velocity(middle, middle, g, now)
        z = z + v * dt
        g[rows, fed] += SURVIVES * np.abs(along) * along / 2 * dt
        inside = np.abs(z) < A * 1.02
        z = np.where(inside, z / np.abs(z) * A * 1.02, z)
        below = z.imag < 0.01
        z = np.where(below, z.real + 0.01j, z)
        after = impulse(z, g)
        found[k] = -np.pi * A**2 * (du[k] + du[k - 1]) / 2 - (after - aged) / dt
    return found
