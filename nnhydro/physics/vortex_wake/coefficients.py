"""The curves C_D(s/D) and C_M(s/D) of the discrete-vortex model, ready for a spline.

From one motion only the sum of drag and inertia load can be known; (26) and (27) split it by a convention: the part of the wake's
load that is proportional to dU/dt at a given wake counts as C_M. `coefficients_across_motions` splits it the way an experiment
does, by motions that pass the same s/D with different dU/dt.
Source: McLain & Rock 1998, eqs. 24-27.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from nnhydro.errors import require
from nnhydro.physics.vortex_wake.choices import WakeChoices
from nnhydro.physics.vortex_wake.kinematics import CylinderMotion, constant_acceleration, power_start
from nnhydro.physics.vortex_wake.potential import Real
from nnhydro.physics.vortex_wake.simulation import WakeHistory, simulate_wake


@final
@dataclass(frozen=True, eq=False)
class VortexCoefficients:
    """Curves on an even grid of travel, starting at s/D = 0 with C_D = 0, C_M = 1."""

    s_over_D: Real  # (n,)
    C_D: Real  # (n,) smoothed over `window` diameters
    C_M: Real  # (n,) smoothed over `window` diameters
    history: WakeHistory  # forces as computed, unsmoothed


@final
@dataclass(frozen=True, eq=False)
class MotionFamilyCoefficients:
    """Curves that describe several motions at once, by least squares at each travel."""

    s_over_D: Real  # (n,)
    C_D: Real  # (n,)
    C_M: Real  # (n,)
    misfit: Real  # (n,) rms over the motions of what is left, in units of (1/2) rho D U^2


def vortex_coefficients(
    travel: float = 10.0,
    choices: WakeChoices | None = None,
    *,
    motion: CylinderMotion | None = None,
    diameter: float = 0.071,
    window: float = 0.25,
    spacing: float = 0.1,
) -> VortexCoefficients:
    """Give C_D(s/D) and C_M(s/D) of a cylinder started from rest.

        F_X = - C_M (pi/4) rho D^2 dU/dt - C_D (1/2) rho D U^2

    travel, window of the moving mean and spacing of the grid in diameters; motion: constant acceleration (3 m/s^2) if None; diameter m.
    Without viscosity in `choices` neither acceleration nor diameter matters.
    Raises ConfigError for values out of range. Source: McLain & Rock 1998, eqs. 24-27.
    """
    require(0 < spacing <= travel, f"spacing is {spacing}: it must be positive and at most the travel, {travel}")
    require(0 <= window < travel, f"window is {window}: it must be 0 or more and less than the travel, {travel}")
    history = simulate_wake(motion or constant_acceleration(3.0), diameter, travel, choices)
    grid = np.arange(0.0, travel + 0.5 * spacing, spacing)
    C_D = _on_grid(grid, history.s_over_D, history.C_D, 0.0, window)
    C_M = _on_grid(grid, history.s_over_D, history.C_M, 1.0, window)
    return VortexCoefficients(grid, C_D, C_M, history)


def coefficients_across_motions(
    exponents: tuple[float, ...] = (1 / 3, 1.0, 3.0),
    travel: float = 10.0,
    choices: WakeChoices | None = None,
    *,
    window: float = 0.5,
    spacing: float = 0.1,
) -> MotionFamilyCoefficients:
    """Give the C_D and C_M that fit starts U ~ t^n of several n at once, as McLain & Rock's fit over several slews does.

        - F_X / (1/2 rho D U^2) = C_D(s/D) + C_M(s/D) (pi/2) (n/(n+1)) (D/s)      least squares over n at each s/D

    exponents n > 0, two or more; travel, window and spacing in diameters. The grid starts at `window`.
    Raises ConfigError for fewer than two exponents. Source: ours, with eq. 24 of McLain & Rock 1998.
    """
    require(len(set(exponents)) >= 2, "two different exponents are needed: one motion cannot tell drag from inertia")
    grid = np.arange(window, travel + 0.5 * spacing, spacing)
    loads = []
    for exponent in exponents:
        h = simulate_wake(power_start(3.0, exponent), 0.071, travel, choices, density=1000.0)
        wake_load = -(h.F_X + 0.25 * np.pi * 1000.0 * 0.071**2 * h.dU) / (0.5 * 1000.0 * 0.071 * h.U**2)
        loads.append(_on_grid(grid, h.s_over_D, wake_load, 0.0, window))
    wake_loads = np.asarray(loads)  # (m, n), the load beyond the ideal C_M = 1, which would swamp the moving mean near s = 0
    lever = np.array([0.5 * np.pi * n / (n + 1) for n in exponents])[:, None] / grid[None, :]  # (m, n)
    centred = lever - lever.mean(0)
    slope = (centred * wake_loads).sum(0) / (centred**2).sum(0)
    C_D = wake_loads.mean(0) - slope * lever.mean(0)
    misfit = np.sqrt(np.mean((wake_loads - C_D - slope * lever) ** 2, axis=0))
    return MotionFamilyCoefficients(grid, C_D, 1.0 + slope, misfit)


def _on_grid(grid: Real, s: Real, values: Real, at_rest: float, window: float) -> Real:
    """Moving mean over `window`, from the integral of the piecewise linear curve through (0, at_rest); narrower at both ends."""
    s, values = np.append(0.0, s), np.append(at_rest, values)
    if window == 0.0:
        return np.interp(grid, s, values)
    integral = np.append(0.0, np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(s)))
    half = np.minimum(0.5 * window, np.minimum(grid, np.maximum(s[-1] - grid, 0.0)))
    wide = half > 1e-9
    mean = np.interp(grid, s, values)
    low, high = grid[wide] - half[wide], grid[wide] + half[wide]
    mean[wide] = (np.interp(high, s, integral) - np.interp(low, s, integral)) / (2.0 * half[wide])
    return mean
