"""Force and coefficients: golden values, and the integrated pressure."""

import json
from pathlib import Path

import numpy as np
import pytest
from potential_flow import complex_pairs, random_flow, transverse_force, velocity, vortex_velocities

from nnhydro.physics.vortex_wake.forces import added_mass_coefficient, drag_coefficient, feeding_force, inline_force
from nnhydro.physics.vortex_wake.potential import image_positions, image_velocities

GOLDEN = json.loads((Path(__file__).parents[3] / "golden" / "potential_flow.json").read_text())
GOLDEN_REL = 1e-10  # stated in the golden file
RHO = 1000.0


@pytest.mark.parametrize("case", GOLDEN["cases"], ids=lambda case: f"{len(case['z_k'])} vortices")
def test_velocities_images_and_forces_match_the_surface_pressure_of_the_golden_file(case):
    c, U, dU, rho = case["c"], case["U"], case["dU"], case["rho"]
    z, Gamma, dGamma = complex_pairs(case["z_k"]), np.array(case["Gamma_k"]), np.array(case["dGamma_k"])
    still, none = np.zeros_like(Gamma), {"rel": GOLDEN_REL, "abs": 1e-12}
    v = vortex_velocities(U, c, z, Gamma)
    assert v.real == pytest.approx(np.array(case["u_k_lab"]), **none)
    assert v.imag == pytest.approx(np.array(case["v_k"]), **none)
    assert image_positions(z, c) == pytest.approx(complex_pairs(case["image_xy"]), **none)
    assert image_velocities(U, c, z, v) == pytest.approx(complex_pairs(case["image_velocity_cylinder_frame"]), **none)
    assert inline_force(rho, c, U, dU, z, Gamma, v, still) == pytest.approx(case["F_X_constant_Gamma_by_pressure"], rel=GOLDEN_REL)
    assert inline_force(rho, c, U, dU, z, Gamma, v, dGamma) == pytest.approx(case["F_X_total_eq18"], rel=GOLDEN_REL)
    growth = inline_force(rho, c, U, 0.0, z, still, v, dGamma)
    assert growth == pytest.approx(case["F_X_Gamma_rate_part"], rel=GOLDEN_REL)
    # absolute part: the lift of the mirrored cases is 0 and the terms that cancel are of order 10 N/m
    assert transverse_force(rho, c, U, z, Gamma, v, still) == pytest.approx(
        case["F_Y_constant_Gamma_by_pressure"], rel=GOLDEN_REL, abs=1e-11
    )


@pytest.mark.parametrize("sample", GOLDEN["self_similar_constant_acceleration"]["samples"], ids=lambda s: f"t={s['t']}")
def test_coefficients_and_force_match_the_self_similar_golden_case(sample):
    case = GOLDEN["self_similar_constant_acceleration"]
    D, rho, a, U = case["D"], case["rho"], case["a"], sample["U"]
    c = 0.5 * D
    # the file gives image height and image velocity only: any vortex with them will do; at 135 deg both can be solved by hand
    R = c**2 * np.sin(0.75 * np.pi) / (sample["qi_over_D"] * D)
    z = R * np.exp(0.75j * np.pi)
    v = U + sample["vi_over_U"] * U * R**2 / c**2 + 1j * sample["v_over_U"] * U
    Gamma = sample["Gamma_over_UD"] * U * D
    dGamma = D * sample["Gamma_over_UD"] * a + sample["dG_ds"] * U**2  # (23)
    pair, strengths, rates = np.array([z, np.conj(z)]), np.array([Gamma, -Gamma]), np.array([dGamma, -dGamma])
    velocities = np.array([v, np.conj(v)])
    C_M = added_mass_coefficient(D, U, pair, strengths)
    C_D = drag_coefficient(D, U, a, pair, strengths, velocities, rates)
    assert sample["s_over_D"] == pytest.approx(0.5 * a * sample["t"] ** 2 / D, rel=GOLDEN_REL)
    assert pytest.approx(sample["C_m"], rel=GOLDEN_REL) == C_M
    assert pytest.approx(sample["C_d"], rel=GOLDEN_REL) == C_D
    assert inline_force(rho, c, U, a, pair, strengths, velocities, rates) == pytest.approx(sample["F_X"], rel=GOLDEN_REL)
    assert -C_M * 0.25 * np.pi * rho * D**2 * a - 0.5 * C_D * rho * D * U**2 == pytest.approx(sample["F_X"], rel=GOLDEN_REL)


def pressure_force(c, U, dU, z, Gamma, n=2048):
    """F_X + i F_Y by Bernoulli on the wall: p/rho = -dPhi/dt + U dPhi/dx - |grad Phi|^2/2, vortices of constant strength."""
    wall = c * np.exp(2j * np.pi * np.arange(n) / n)
    v, h = vortex_velocities(U, c, z, Gamma), 1e-5

    def phase(t):  # potential at a point of the wall, the moving parts as ratios of logarithms' arguments
        zt, Ut = z + (v - U) * t, U + dU * t
        return Ut * c**2 / wall, (wall[:, None] - zt) / (wall[:, None] - c**2 / np.conj(zt))

    (d1, r1), (d0, r0) = phase(h), phase(-h)
    dPhi = -((d1 - d0) + 0.5j / np.pi * np.log(r1 / r0) @ Gamma).real / (2 * h)
    grad = velocity(wall, U, c, z, Gamma)
    p = RHO * (-dPhi + U * grad.real - 0.5 * np.abs(grad) ** 2)
    return -np.mean(p * wall / c) * 2 * np.pi * c


@pytest.mark.parametrize("seed", range(5))
def test_both_forces_equal_the_integrated_bernoulli_pressure(seed):
    c, U, dU, z, Gamma, _ = random_flow(seed)
    v, still = vortex_velocities(U, c, z, Gamma), np.zeros_like(Gamma)
    F = pressure_force(c, U, dU, z, Gamma)
    # the central difference in time leaves 1e-7
    assert inline_force(RHO, c, U, dU, z, Gamma, v, still) == pytest.approx(F.real, rel=1e-6, abs=1e-5)
    assert transverse_force(RHO, c, U, z, Gamma, v, still) == pytest.approx(F.imag, rel=1e-6, abs=1e-5)


@pytest.mark.parametrize("foot", [1.7, 2.3, 2.9])
def test_growth_and_feeding_force_equal_the_pressure_with_its_step_at_the_foot_of_the_sheet(foot):
    c, z, dGamma = 0.04, np.array([-0.05 + 0.03j]), np.array([0.7])
    x, weight = np.polynomial.legendre.leggauss(200)
    theta = foot + np.pi * (1 + x)  # once round the wall, from one side of the sheet to the other
    wall = c * np.exp(1j * theta)
    dPhi = np.unwrap(np.angle((wall - z[0]) / (wall - image_positions(z, c)[0]))) * dGamma[0] / (2 * np.pi)
    by_pressure = RHO * c * np.sum(np.pi * weight * dPhi * np.cos(theta))
    moving = np.zeros(1, dtype=complex)
    printed = inline_force(RHO, c, 0.0, 0.0, z, np.zeros(1), moving, dGamma)
    assert printed + feeding_force(RHO, np.array([c * np.sin(foot)]), dGamma) == pytest.approx(by_pressure, rel=1e-9)


def test_without_vortices_the_force_is_that_of_the_displaced_water():
    none, empty = np.zeros(0), np.zeros(0, dtype=complex)
    assert inline_force(RHO, 0.05, 0.6, 2.0, empty, none, empty, none) == pytest.approx(-RHO * np.pi * 0.05**2 * 2.0, rel=1e-15)
    assert added_mass_coefficient(0.1, 0.6, empty, none) == 1.0
    assert drag_coefficient(0.1, 0.6, 2.0, empty, none, empty, none) == 0.0
