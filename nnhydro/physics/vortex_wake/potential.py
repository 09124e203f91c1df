"""Images of point vortices in a moving circular cylinder.

    w(z) = U c^2 / z + (i / 2 pi) sum_k Gamma_k [ ln(z - z_k) - ln(z - c^2 / conj z_k) ]      (4)
    u - i v = - dw/dz                                                                          in the frame of the water at rest

    z        position relative to the cylinder's centre                                       [m]
    U        speed of the cylinder along +X through water at rest                              [m/s]
    c        radius of the cylinder                                                            [m]
    Gamma_k  circulation of vortex k, positive counter-clockwise                               [m^2/s]

The images at the centre are dropped, as McLain & Rock do between (3) and (4): a vortex leaves the cylinder with the opposite
circulation, as it does when it was shed by the cylinder's own boundary layer. wake.py moves vortices by (4); tests/potential_flow.py has
(4) itself.
Source: McLain & Rock 1998, eqs. 3, 4, 12-16.
"""

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


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
