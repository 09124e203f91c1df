"""Force of the water on the cylinder and the coefficients made of it.

    F_X = - rho sum Gamma_k (v_k - v_ki) + rho sum q_ki dGamma_k/dt - (pi/4) rho D^2 dU/dt              (18)
    C_M = 1 - sum (4/pi) (q_ki/D) (Gamma_k/UD)                                                          (26)
    C_D = 2 sum (Gamma_k/UD) (v_k - v_ki)/U - 2 sum (q_ki/D) G'_k,   G'_k = d(Gamma_k/UD)/d(s/D)         (27)

A growing vortex is fed by a sheet from the body. Behind the sheet the total head is lower by rho dGamma/dt; (18) does not contain
that pressure step. `feeding_force` is the missing part, so that (18) + feeding force = - d(impulse)/dt for vortices born at the
surface. The surface-pressure integral with the step at the foot of the sheet gives the same
(tests/unit/physics/vortex_wake/test_forces.py).
Source: McLain & Rock 1998, eqs. 18, 23-27; the feeding force is ours.
"""

import numpy as np

from nnhydro.physics.vortex_wake.potential import Complex, Real, image_positions, image_velocities


def inline_force(rho: float, radius: float, U: float, dU: float, z_k: Complex, Gamma_k: Real, velocity_k: Complex, dGamma_k: Real) -> float:
    """Give the in-line force of the water on the cylinder, N a metre of span.

        F_X = - rho sum Gamma_k (v_k - v_ki) + rho sum q_ki dGamma_k/dt - (pi/4) rho D^2 dU/dt

    rho kg/m^3; radius m; U m/s; dU m/s^2; z_k (k,) m; Gamma_k (k,) m^2/s; velocity_k (k,) m/s in the frame of the water at rest;
    dGamma_k (k,) m^2/s^2.
    Source: McLain & Rock 1998, eq. 18.
    """
    image = image_positions(z_k, radius)
    image_velocity = image_velocities(U, radius, z_k, velocity_k)
    wake = -np.sum(Gamma_k * (velocity_k.imag - image_velocity.imag)) + np.sum(image.imag * dGamma_k)
    return float(rho * wake - np.pi * rho * radius**2 * dU)


def feeding_force(rho: float, q_sheet: Real, dGamma_k: Real) -> float:
    """Give the in-line force that (18) omits: the pressure step across the sheets that feed growing vortices, N/m.

        F_feed = - rho sum q_sheet,k dGamma_k/dt

    rho kg/m^3; q_sheet (k,) m: height above the X axis of the foot of the sheet; dGamma_k (k,) m^2/s^2.
    Source: ours, unsteady Bernoulli equation with the step of the potential at the foot of the sheet.
    """
    return float(-rho * np.sum(q_sheet * dGamma_k))


def added_mass_coefficient(diameter: float, U: float, z_k: Complex, Gamma_k: Real) -> float:
    """Give C_M = 1 - sum (4/pi)(q_ki/D)(Gamma_k/UD), dimensionless; diameter m, U m/s, z_k (k,) m, Gamma_k (k,) m^2/s.

    Source: McLain & Rock 1998, eq. 26.
    """
    q_image = image_positions(z_k, 0.5 * diameter).imag
    return float(1.0 - 4.0 / np.pi * np.sum(q_image / diameter * Gamma_k / (U * diameter)))


def drag_coefficient(diameter: float, U: float, dU: float, z_k: Complex, Gamma_k: Real, velocity_k: Complex, dGamma_k: Real) -> float:
    """Give C_D as printed, dimensionless.

        C_D = 2 sum (Gamma_k/UD)(v_k - v_ki)/U - 2 sum (q_ki/D) G'_k,   G'_k = (dGamma_k/dt - (Gamma_k/U) dU/dt) / U^2   from (23)

    diameter m; U m/s; dU m/s^2; z_k (k,) m; Gamma_k (k,) m^2/s; velocity_k (k,) m/s in the frame of the water at rest;
    dGamma_k (k,) m^2/s^2.
    Source: McLain & Rock 1998, eqs. 23, 27.
    """
    radius = 0.5 * diameter
    q_image = image_positions(z_k, radius).imag
    image_velocity = image_velocities(U, radius, z_k, velocity_k)
    strength = Gamma_k / (U * diameter)
    strength_slope = (dGamma_k - Gamma_k * dU / U) / U**2
    cross_speed = (velocity_k.imag - image_velocity.imag) / U
    return float(2.0 * np.sum(strength * cross_speed) - 2.0 * np.sum(q_image / diameter * strength_slope))
