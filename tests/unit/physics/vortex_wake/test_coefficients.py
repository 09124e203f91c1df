"""The curves on their grid, and the moving mean."""

import numpy as np

from nnhydro.physics.vortex_wake.coefficients import _on_grid, coefficients_across_motions, vortex_coefficients
from nnhydro.physics.vortex_wake.kinematics import power_start
from nnhydro.physics.vortex_wake.simulation import simulate_wake


def test_the_moving_mean_is_that_of_the_piecewise_line_and_narrows_at_both_ends():
    s = np.linspace(0.05, 4.0, 80)
    grid = np.array([0.0, 0.1, 1.0, 3.0, 3.9, 4.0])
    np.testing.assert_allclose(_on_grid(grid, s, 2 + 3 * s, 2.0, 0.5), 2 + 3 * grid, rtol=1e-9)
    square = _on_grid(grid, s, s**2, 0.0, 0.5)
    half = np.array([0.0, 0.1, 0.25, 0.25, 0.1, 0.0])
    np.testing.assert_allclose(square, grid**2 + half**2 / 3, atol=2e-3)
    np.testing.assert_allclose(_on_grid(grid, s, s**2, 0.0, 0.0), grid**2, atol=2e-3)


def test_curves_lie_on_an_even_grid_from_rest_to_the_end():
    curves = vortex_coefficients(1.0, window=0.1, spacing=0.25)
    np.testing.assert_allclose(curves.s_over_D, [0.0, 0.25, 0.5, 0.75, 1.0])
    assert (curves.C_D[0], curves.C_M[0]) == (0.0, 1.0)
    np.testing.assert_allclose(curves.C_D, _on_grid(curves.s_over_D, curves.history.s_over_D, curves.history.C_D, 0.0, 0.1))
    several = coefficients_across_motions((1.0, 3.0), 1.0, window=0.5, spacing=0.25)
    np.testing.assert_allclose(several.s_over_D, [0.5, 0.75, 1.0])
    np.testing.assert_allclose(several.misfit, 0.0, atol=1e-9)  # two motions fix two coefficients
    for n in (1.0, 3.0):
        h = simulate_wake(power_start(3.0, n), 0.071, 1.0, density=1000.0)
        ideal = np.pi / 4 * 1000.0 * 0.071**2 * h.dU
        load = _on_grid(several.s_over_D, h.s_over_D, -(h.F_X + ideal) / (500.0 * 0.071 * h.U**2), 0.0, 0.5)
        lever = np.pi / 2 * n / (n + 1) / several.s_over_D  # D dU/dt / U^2 of U ~ t^n
        np.testing.assert_allclose(several.C_D + (several.C_M - 1) * lever, load, rtol=1e-9)
