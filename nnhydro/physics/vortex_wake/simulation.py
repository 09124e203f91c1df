"""March of a cylinder from rest with a symmetric wake shed at the separation points.

Each step of equal travel: a vortex Gamma = (dGamma/dt) dt is placed above the separation point, all vortices are carried by the
midpoint rule (second-order Runge-Kutta), the force is taken at the midpoint, absorbed vortices are removed and far ones merged.
The force is (18) plus `feeding_force`: together the rate of change of the impulse -rho [sum Gamma_k (q_k - q_ki) + pi c^2 U].
There is no asymmetry, hence no vortex shedding, no lift and no fall of the drag after the symmetric pair breaks up.
Source: McLain & Rock 1998, section 2, for the flow and the force; the feeding is ours (separation.py).
"""

from dataclasses import dataclass, fields
from typing import final

import numpy as np

from nnhydro.errors import require
from nnhydro.physics.vortex_wake.choices import WakeChoices
from nnhydro.physics.vortex_wake.forces import added_mass_coefficient, drag_coefficient, feeding_force, inline_force
from nnhydro.physics.vortex_wake.kinematics import CylinderMotion
from nnhydro.physics.vortex_wake.potential import Complex, Real, image_positions
from nnhydro.physics.vortex_wake.separation import circulation_flux, separation_angle
from nnhydro.physics.vortex_wake.wake import EMPTY, Wake, merge, wake_velocities, without_absorbed


@final
@dataclass(frozen=True, eq=False)
class WakeHistory:
    """What the march gives at the middle of each of n steps; `impulse` and `final` belong to the ends of steps."""

    s_over_D: Real  # (n,) travel in diameters
    t: Real  # (n,) s
    U: Real  # (n,) m/s
    dU: Real  # (n,) m/s^2
    F_X: Real  # (n,) N/m, of the water on the cylinder
    C_M: Real  # (n,) (26)
    C_D: Real  # (n,) (27) + feeding force: F_X = - C_M (pi/4) rho D^2 dU/dt - C_D (1/2) rho D U^2 holds exactly
    circulation: Real  # (n,) Gamma/(U D) of the upper half
    separation: Real  # (n,) rad from the front stagnation point; NaN before separation
    vortices: Real  # (n,) number in the upper half
    shed: Real  # (n,) m^2/s, circulation shed so far into the upper half
    impulse: Real  # (n,) m^3/s, sum Gamma (q - q_i) + pi c^2 U at the end of the step, over the density
    final: Wake  # the wake at the end


ROW = tuple(item.name for item in fields(WakeHistory) if item.name != "final")


@final
@dataclass(frozen=True)
class _Step:
    t: float
    t_middle: float
    t_end: float
    s_middle: float
    s_first_half: float
    length: float


def simulate_wake(
    motion: CylinderMotion, diameter: float, travel: float, choices: WakeChoices | None = None, density: float = 1000.0
) -> WakeHistory:
    """Give forces and circulation of a cylinder that follows `motion` from rest over `travel` diameters.

        F_X = - rho sum Gamma_k (v_k - v_ki) + rho sum (q_ki - q_k) dGamma_k/dt - (pi/4) rho D^2 dU/dt

    diameter m; travel in diameters; density kg/m^3. The same arguments give the same numbers.
    Raises ConfigError for lengths that are not positive or a motion known over less than `travel`.
    Source: McLain & Rock 1998, eqs. 18, 26, 27.
    """
    choices = choices or WakeChoices()
    require(diameter > 0 and density > 0 and travel > 0, "diameter, density and travel must be positive")
    require(
        travel * diameter <= motion.farthest,
        f"the motion covers {motion.farthest / diameter:.3g} diameters, {travel:g} were asked for: shorten travel or record longer",
    )
    wake, shed, rows = EMPTY, 0.0, []
    for step in _steps(motion, diameter, travel, choices):
        wake, birth, flux = _feed(wake, step, motion, diameter, choices)
        wake, row = _advance(wake, birth, flux, step, motion, diameter, density, choices)
        wake = without_absorbed(wake, 0.5 * diameter, choices.remove_within * diameter)
        wake = merge(wake, choices.merge_distance * diameter, choices.merge_beyond * diameter)
        shed += flux * (step.t_end - step.t)
        rows.append((*row, shed, _impulse(wake, float(motion.speed(np.asarray(step.t_end))), 0.5 * diameter)))
    return WakeHistory(final=wake, **dict(zip(ROW, np.asarray(rows, dtype=np.float64).T, strict=True)))


def _steps(motion: CylinderMotion, diameter: float, travel: float, choices: WakeChoices) -> list[_Step]:
    """Steps of equal travel, with the times at their beginning, middle and end."""
    count = max(int(np.ceil(travel / choices.step - 1e-9)), 1)
    s = np.linspace(0.0, travel * diameter, count + 1)
    t = motion.time_at(s)
    middle = 0.5 * (t[1:] + t[:-1])
    s_middle = motion.travel(middle)
    columns = (t[:-1], middle, t[1:], s_middle, s_middle - s[:-1], np.diff(s))
    return [_Step(*(float(value) for value in row)) for row in zip(*columns, strict=True)]


def _feed(wake: Wake, step: _Step, motion: CylinderMotion, diameter: float, choices: WakeChoices) -> tuple[Wake, complex, float]:
    """Shed one vortex; give the wake, where it was born (m) and the flux of circulation (m^2/s^2)."""
    radius, U = 0.5 * diameter, float(motion.speed(np.asarray(step.t_middle)))
    theta = separation_angle(step.s_middle / diameter, choices)
    if theta is None:
        return wake, complex(radius), 0.0
    # theta runs from the front, which is at +X, so it is the polar angle too
    birth = complex((radius + choices.offset * diameter) * np.exp(1j * theta))
    core = wake.cores(step.t, diameter, choices)
    flux = circulation_flux(theta, U, radius, core, wake.z, wake.Gamma, choices)
    return wake.with_vortex(birth, flux * (step.t_end - step.t), step.t), birth, flux


def _advance(
    wake: Wake, birth: complex, flux: float, step: _Step, motion: CylinderMotion, diameter: float, density: float, choices: WakeChoices
) -> tuple[Wake, tuple[float, ...]]:
    """Carry the wake over one step; give it and the row of `WakeHistory` at the midpoint."""
    radius = 0.5 * diameter
    U_start, U = (float(motion.speed(np.asarray(t))) for t in (step.t, step.t_middle))
    start = wake_velocities(wake, U_start, radius, wake.cores(step.t, diameter, choices))
    middle = wake.shifted_by(start * (step.t_middle - step.t) - step.s_first_half)
    carried = wake_velocities(middle, U, radius, middle.cores(step.t_middle, diameter, choices))
    row = _loads(middle, carried, birth, flux, step, motion, diameter, density)
    theta = np.angle(birth) if flux > 0.0 else np.nan
    ended = wake.shifted_by(carried * (step.t_end - step.t) - step.length)
    return ended, (*row, float(wake.Gamma.sum() / (U * diameter)), float(theta), float(wake.z.size))


def _loads(
    wake: Wake, carried: Complex, birth: complex, flux: float, step: _Step, motion: CylinderMotion, diameter: float, density: float
) -> tuple[float, ...]:
    """Give s/D, t, U, dU, F_X, C_M and C_D at the midpoint."""
    radius = 0.5 * diameter
    U, dU = (float(f(np.asarray(step.t_middle))) for f in (motion.speed, motion.acceleration))
    z, Gamma = wake.whole()
    velocity_k = np.concatenate([carried, np.conj(carried)])
    # shed vortices keep their strength; what grows is the nascent pair, at its place of birth and before it has any strength
    z, Gamma = np.append(z, [birth, birth.conjugate()]), np.append(Gamma, [0.0, 0.0])
    velocity_k, dGamma = np.append(velocity_k, [U, U]), np.append(np.zeros(z.size - 2), [flux, -flux])
    # the sheet is taken to end at the nascent vortex, not at the wall: then the momentum of water and cylinder is kept exactly
    feed = feeding_force(density, z.imag, dGamma)
    F_X = inline_force(density, radius, U, dU, z, Gamma, velocity_k, dGamma) + feed
    C_M = added_mass_coefficient(diameter, U, z, Gamma)
    printed = drag_coefficient(diameter, U, dU, z, Gamma, velocity_k, dGamma)
    return step.s_middle / diameter, step.t_middle, U, dU, F_X, C_M, printed - feed / (0.5 * density * diameter * U**2)


def _impulse(wake: Wake, U: float, radius: float) -> float:
    q, q_image = wake.z.imag, image_positions(wake.z, radius).imag
    return float(2.0 * np.sum(wake.Gamma * (q - q_image)) + np.pi * radius**2 * U)
