"""Where the boundary layer leaves the cylinder and how much circulation it carries.

    cos(theta_s) = - (s_0 / s)             first-order boundary layer: from the rear (180 deg) at s_0 towards the shoulder (90 deg)
    dGamma/dt    = U_s^2 / 2               flux of vorticity through the layer that leaves; (U_s^2 - U_r^2)/2 with `reversed_flow`

    theta   angle from the front stagnation point, upper half                                   [rad]
    U_s     speed of the water past the wall just ahead of separation, positive downstream      [m/s]
    U_r     fastest reversed speed past the wall between separation and the rear                [m/s]

The reversed flow has a boundary layer of its own, which brings circulation of the other sign to the same point. Left out by default:
with it a constant acceleration shows the measured overshoot, but an impulsive start falls to C_D = 0.7 and a fit over several motions
gives C_M > 1, both against measurement.
Source: U_s^2/2 is the usual flux of discrete-vortex models; theta_s from the series of Blasius 1908; U_r^2/2 is ours.
"""

import numpy as np

from nnhydro.physics.vortex_wake.choices import WakeChoices
from nnhydro.physics.vortex_wake.potential import Complex, Real

BASE_POINTS = 24  # where the reversed speed is looked for; doubling them changes C_D by less than 0.002


def separation_angle(s_over_D: float, choices: WakeChoices) -> float | None:
    """Give the angle of separation from the front stagnation point, rad, or None before separation begins.

        cos(theta_s) = - separation_onset / (s/D)

    Source: Blasius 1908, first order, for constant acceleration; used for every motion.
    """
    if s_over_D <= choices.separation_onset:
        return None
    return float(np.arccos(-choices.separation_onset / s_over_D))


def surface_speed(theta: Real, U: float, radius: float, core: Real, z: Complex, Gamma: Real) -> Real:
    """Give the speed of the water past the wall, positive from front to rear, m/s, for a wake mirrored about the X axis.

        u_theta = 2 U sin(theta) - sum Gamma_k (|z_k|^2 - c^2) / (2 pi c) [1/(|z - z_k|^2 + delta^2) - 1/(|z - conj z_k|^2 + delta^2)]

    theta (n,) rad; U m/s; radius m; core delta (k,) m; z (k,) m and Gamma (k,) m^2/s of the upper half.
    The sum is a vortex and its image on the circle, smoothed like the vortices' action on each other.
    Source: McLain & Rock 1998, eq. 4 on |z| = c.
    """
    wall = radius * np.exp(1j * theta)[:, None]  # (n, 1) m
    nearness = 1.0 / (np.abs(wall - z) ** 2 + core**2) - 1.0 / (np.abs(wall - np.conj(z)) ** 2 + core**2)  # (n, k) 1/m^2
    return np.asarray(2.0 * U * np.sin(theta) - nearness @ (Gamma * (np.abs(z) ** 2 - radius**2)) / (2.0 * np.pi * radius))


def circulation_flux(theta_s: float, U: float, radius: float, core: Real, z: Complex, Gamma: Real, choices: WakeChoices) -> float:
    """Give dGamma/dt of the upper shear layer, m^2/s^2, never negative.

        dGamma/dt = survival * max(U_s^2 - U_r^2, 0) / 2,   U_s = 0 if reversed, U_r = 0 unless `reversed_flow` is chosen

    theta_s rad; the rest as in `surface_speed`.
    Source: see the module.
    """
    ahead = np.array([theta_s - np.deg2rad(choices.sample_ahead)])
    leaving = max(float(surface_speed(ahead, U, radius, core, z, Gamma)[0]), 0.0)
    flux = 0.5 * leaving**2
    if choices.reversed_flow:
        base = np.linspace(theta_s, np.pi, BASE_POINTS + 2)[1:-1]
        flux -= 0.5 * min(float(surface_speed(base, U, radius, core, z, Gamma).min()), 0.0) ** 2
    return choices.survival * max(flux, 0.0)
