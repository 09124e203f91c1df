"""One swinging cylinder after McLain and Rock (1998), computed by brute force: the planted truth of this data set.

    tau = I_hub alpha + sum_s l_s dF_s                                                                      [N m]
    dF  = [ C_M(s/D) rho pi D^2/4 l alpha + 1/2 rho C_D(s/D) D |l omega| l omega ] dl                         [N]
    s   = l |theta - theta_start|, counted from the start of the slew and never reset                         [m]

C_D and C_M are cubic splines through 0 (C_D) or 1 (C_M) at s/D = 0, five equally spaced ordinates and one steady
value at s/D = tau_s; no curvature at 0, no slope at tau_s, constant beyond. The ordinates are chosen so that the
curves pass through the numbers the paper states of its Figure 7.
tau is what the drive exerts (LOAD; the paper's T_hyd has the other sign and the arm's inertia removed). SI, rad.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]

STRIPS = 200  # the midpoint sum is then within 1e-5 of the integral
RHO = 1000.0  # kg/m3
TAU_S = 8.0  # D
C_D = (0.430, 0.894, 1.018, 0.809, 0.748, 0.780)  # d1..d5, ds
C_M = (0.840, 0.460, 0.205, 0.276, 0.332, 0.360)  # m1..m5, ms


@dataclass(frozen=True)
class Arm:
    """Hollow PVC cylinder, sealed, turning about one end."""

    length: float = 0.65  # m
    diameter: float = 0.071  # m
    bore: float = 0.065  # m
    density: float = 1400.0  # kg/m3

    @property
    def mass(self) -> float:  # kg
        return self.density * np.pi / 4 * (self.diameter**2 - self.bore**2) * self.length

    @property
    def inertia(self) -> float:  # kg m2 about the mass centre (Rivera 1995, 3-3-7)
        return self.mass / 48 * (3 * (self.diameter**2 + self.bore**2) + 4 * self.length**2)


def curve(start: float, ordinates: tuple[float, ...], tau_s: float, travel: Array) -> Array:
    """Coefficient at `travel` = s/D."""
    knots = np.linspace(0.0, tau_s, 7)
    spline = CubicSpline(knots, (start, *ordinates), bc_type=((2, 0.0), (1, 0.0)))
    return spline(np.minimum(travel, tau_s))


def hydrodynamic_torque(arm: Arm, theta: Array, omega: Array, alpha: Array, strips: int = STRIPS) -> Array:
    """(n,) N m: what the drive supplies against the water. theta counts from the start of the slew."""
    dl = arm.length / strips
    lever = (np.arange(strips) + 0.5) * dl
    travel = np.abs(theta)[:, None] * lever / arm.diameter
    speed = omega[:, None] * lever
    drag = 0.5 * RHO * curve(0.0, C_D, TAU_S, travel) * arm.diameter * np.abs(speed) * speed
    area = np.pi * arm.diameter**2 / 4
    inertia = RHO * curve(1.0, C_M, TAU_S, travel) * area * alpha[:, None] * lever
    return ((drag + inertia) * lever * dl).sum(axis=1)


def drive_torque(arm: Arm, theta: Array, omega: Array, alpha: Array) -> Array:
    """(n,) N m: water and the arm's own inertia, noise-free."""
    about_hub = arm.inertia + arm.mass * (arm.length / 2) ** 2
    return about_hub * alpha + hydrodynamic_torque(arm, theta, omega, alpha)
