"""Potential flow of a moving circular cylinder with point vortices outside it.

    w(z) = U c^2 / z + (i / 2 pi) sum_k Gamma_k [ ln(z - z_k) - ln(z - c^2 / conj z_k) ]      (4)
    u - i v = - dw/dz                                                                          in the frame of the water at rest

    z        position relative to the cylinder's centre                                       [m]
    U        speed of the cylinder along +X through water at rest                              [m/s]
    c        radius of the cylinder                                                            [m]
    Gamma_k  circulation of vortex k, positive counter-clockwise                               [m^2/s]

The images at the centre are dropped, as McLain & Rock do between (3) and (4): a vortex leaves the cylinder with the opposite
circulation, as it does when it was shed by the cylinder's own boundary layer.
Source: McLain & Rock 1998, eqs. 3, 4, 12-16.
"""

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


def complex_potential(z: Complex, U: float, radius: float, z_k: Complex, Gamma_k: Real) -> Complex:
    """Give the complex potential at points outside the cylinder, on the principal branch of each logarithm.

        w = U c^2/z + (i/2 pi) sum Gamma_k [ln(z - z_k) - ln(z - c^2/conj z_k)]

    z (n,) m; U m/s; radius c in m; z_k (k,) m; Gamma_k (k,) m^2/s. Returns (n,) m^2/s.
    Source: McLain & Rock 1998, eq. 4.
    """
    to_vortex = z[:, None] - z_k[None, :]  # (n, k) m
    to_image = z[:, None] - image_positions(z_k, radius)[None, :]  # (n, k) m
    return np.asarray(U * radius**2 / z + 0.5j / np.pi * (np.log(to_vortex) - np.log(to_image)) @ Gamma_k)


def velocity(z: Complex, U: float, radius: float, z_k: Complex, Gamma_k: Real) -> Complex:
    """Give u + i v of the water, in the frame of the water at rest, at points that are not vortices.

        u - i v = U c^2/z^2 - (i/2 pi) sum Gamma_k [1/(z - z_k) - 1/(z - c^2/conj z_k)]

    z (n,) m; U m/s; radius c in m; z_k (k,) m; Gamma_k (k,) m^2/s. Returns (n,) m/s.
    Source: McLain & Rock 1998, eq. 4 differentiated.
    """
    to_vortex = z[:, None] - z_k[None, :]  # (n, k) m
    to_image = z[:, None] - image_positions(z_k, radius)[None, :]  # (n, k) m
    conjugate = U * radius**2 / z**2 - 0.5j / np.pi * (1.0 / to_vortex - 1.0 / to_image) @ Gamma_k
    return np.asarray(np.conj(conjugate))


def vortex_velocities(U: float, radius: float, z_k: Complex, Gamma_k: Real) -> Complex:
    """Give u_k + i v_k at each vortex: induced by the cylinder, all images and every vortex but itself.

    U m/s; radius c in m; z_k (k,) m; Gamma_k (k,) m^2/s. Returns (k,) m/s in the frame of the water at rest.
    Source: McLain & Rock 1998, section 2, velocities in eq. 9.
    """
    to_vortex = z_k[:, None] - z_k[None, :]  # (k, k) m
    np.fill_diagonal(to_vortex, np.inf)  # a vortex does not move itself
    to_image = z_k[:, None] - image_positions(z_k, radius)[None, :]  # (k, k) m
    conjugate = U * radius**2 / z_k**2 - 0.5j / np.pi * (1.0 / to_vortex - 1.0 / to_image) @ Gamma_k
    return np.asarray(np.conj(conjugate))


def image_positions(z_k: Complex, radius: float) -> Complex:
    """Give the images p_ki + i q_ki = c^2 / conj z_k inside the cylinder; z_k (k,) m, radius in m, result (k,) m.

    Source: McLain & Rock 1998, eqs. 12, 13.
    """
    return np.asarray(radius**2 / np.conj(z_k))


def image_velocities(U: float, radius: float, z_k: Complex, velocity_k: Complex) -> Complex:
    """Give u_ki + i v_ki of the images in the frame of the cylinder: the time derivative of their positions.

        d/dt (c^2 / conj z_k) = - c^2 conj(u_k - U + i v_k) / conj(z_k)^2

    U m/s; radius c in m; z_k (k,) m; velocity_k = u_k + i v_k (k,) m/s in the frame of the water at rest. Returns (k,) m/s.
    Source: McLain & Rock 1998, eqs. 14-16.
    """
    return np.asarray(-(radius**2) * np.conj(velocity_k - U) / np.conj(z_k) ** 2)
