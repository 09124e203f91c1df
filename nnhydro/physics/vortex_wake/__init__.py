"""The discrete-vortex model from which C_D(s/D) and C_M(s/D) of a cylinder started from rest come.

    potential      complex potential, velocities and images of point vortices outside a moving cylinder   (eqs. 4, 12-16)
    forces         in-line and transverse force, coefficients C_D and C_M                                (eqs. 18, 19, 26, 27)
    kinematics     how the cylinder moves: constant acceleration, a power of time, a sampled speed
    choices        every choice of the simulation, with its default and reason
    separation     where the boundary layer leaves, how much circulation it carries
    wake           the vortices of the upper half and how they are kept few
    simulation     the march through travel: forces and circulation along the way
    coefficients   the curves, ready for a spline

Range: two-dimensional, inviscid but for the separation rule, symmetric wake: travels up to about ten diameters.
Source: McLain & Rock (1998), Int. J. Robotics Research 17(7), section 2.
"""

from nnhydro.physics.vortex_wake.choices import WakeChoices
from nnhydro.physics.vortex_wake.coefficients import (
    MotionFamilyCoefficients,
    VortexCoefficients,
    coefficients_across_motions,
    vortex_coefficients,
)
from nnhydro.physics.vortex_wake.kinematics import CylinderMotion, constant_acceleration, power_start, sampled_motion
from nnhydro.physics.vortex_wake.simulation import WakeHistory, simulate_wake

__all__ = [
    "CylinderMotion",
    "MotionFamilyCoefficients",
    "VortexCoefficients",
    "WakeChoices",
    "WakeHistory",
    "coefficients_across_motions",
    "constant_acceleration",
    "power_start",
    "sampled_motion",
    "simulate_wake",
    "vortex_coefficients",
]
