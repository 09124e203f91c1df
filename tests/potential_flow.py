"""Potential flow of a moving cylinder with any vortices outside it: the reference for the mirrored wake that the simulation marches.

    w(z) = U c^2 / z + (i / 2 pi) sum_k Gamma_k [ ln(z - z_k) - ln(z - c^2 / conj z_k) ]      (4)
    u - i v = - dw/dz                                                                          in the frame of the water at rest
    F_Y = rho sum Gamma_k (u_k - U - u_ki) - rho sum p_ki dGamma_k/dt                          (19)

Arrays z (n,), z_k (k,) in m, Gamma_k (k,) in m^2/s, dGamma_k (k,) in m^2/s^2; speed U in m/s, radius c in m. u_k in (19) is taken in the
frame of the cylinder: only then does (19) equal the integrated surface pressure when the circulations do not add up to zero.
Source: McLain & Rock 1998, eqs. 4, 9, 19.
"""

import numpy as np

from nnhydro.physics.vortex_wake.potential import image_positions, image_velocities


def complex_potential(z, U, c, z_k, Gamma_k):
    """Return w (n,) m^2/s at points outside the cylinder, on the principal branch of each logarithm."""
    return U * c**2 / z + 0.5j / np.pi * (np.log(z[:, None] - z_k) - np.log(z[:, None] - c**2 / np.conj(z_k))) @ Gamma_k


def velocity(z, U, c, z_k, Gamma_k):
    """Return u + i v (n,) m/s of the water at points that are not vortices."""
    return np.conj(U * c**2 / z**2 - 0.5j / np.pi * (1 / (z[:, None] - z_k) - 1 / (z[:, None] - c**2 / np.conj(z_k))) @ Gamma_k)


def vortex_velocities(U, c, z_k, Gamma_k):
    """Return u_k + i v_k (k,) m/s of each vortex: induced by the cylinder, all images and every vortex but itself."""
    to_vortex = z_k[:, None] - z_k
    np.fill_diagonal(to_vortex, np.inf)
    return np.conj(U * c**2 / z_k**2 - 0.5j / np.pi * (1 / to_vortex - 1 / (z_k[:, None] - c**2 / np.conj(z_k))) @ Gamma_k)


def transverse_force(rho, c, U, z_k, Gamma_k, velocity_k, dGamma_k):
    """Return F_Y, the lift of the water on the cylinder, N a metre of span."""
    image, moved = image_positions(z_k, c), image_velocities(U, c, z_k, velocity_k)
    return float(rho * np.sum(Gamma_k * (velocity_k.real - U - moved.real)) - rho * np.sum(image.real * dGamma_k))


def complex_pairs(rows):
    """Pairs (real, imaginary part) as complex numbers (n,)."""
    return np.array([complex(*row) for row in rows], dtype=complex)


def random_flow(seed, n=5):
    """Vortices well outside a cylinder of radius 0.04 m: radius, U, dU, z_k, Gamma_k, dGamma_k."""
    rng = np.random.default_rng(seed)
    z = 0.04 * rng.uniform(1.3, 3.0, n) * np.exp(1j * rng.uniform(-np.pi, np.pi, n))
    return 0.04, 0.8, -1.7, z, rng.normal(0, 0.05, n), rng.normal(0, 0.5, n)
