"""Images keep the water out of the cylinder, and the circulation."""

import numpy as np
import pytest
from potential_flow import complex_potential, velocity


def random_flow(seed, n=5):
    """Vortices well outside a cylinder of radius 0.04 m: radius, U, dU, z_k, Gamma_k, dGamma_k."""
    rng = np.random.default_rng(seed)
    z = 0.04 * rng.uniform(1.3, 3.0, n) * np.exp(1j * rng.uniform(-np.pi, np.pi, n))
    return 0.04, 0.8, -1.7, z, rng.normal(0, 0.05, n), rng.normal(0, 0.5, n)


def test_velocity_is_minus_the_gradient_of_the_complex_potential():
    c, U, _, z, Gamma, _ = random_flow(1)
    at, h = np.array([0.09 + 0.02j, -0.03 + 0.11j, 0.2 - 0.1j]), 1e-6
    slope = (complex_potential(at + h, U, c, z, Gamma) - complex_potential(at - h, U, c, z, Gamma)) / (2 * h)
    assert np.conj(velocity(at, U, c, z, Gamma)) == pytest.approx(-slope, rel=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_no_water_passes_the_wall(seed):
    c, U, _, z, Gamma, _ = random_flow(seed)
    normal = np.exp(1j * np.linspace(0, 2 * np.pi, 50))
    through = (np.conj(normal) * (velocity(c * normal, U, c, z, Gamma) - U)).real
    assert np.abs(through).max() < 1e-13 * np.abs(velocity(c * normal, U, c, z, Gamma)).max() + 1e-14


def test_circulation_round_everything_is_zero_and_round_the_cylinder_minus_that_of_the_vortices():
    c, U, _, z, Gamma, _ = random_flow(2)
    unit = np.exp(2j * np.pi * np.arange(4096) / 4096)

    def round_circle(radius):
        return np.mean((np.conj(velocity(radius * unit, U, c, z, Gamma)) * 2j * np.pi * radius * unit).real)

    assert round_circle(c) == pytest.approx(-Gamma.sum(), rel=1e-9)
    assert round_circle(5 * c) == pytest.approx(0.0, abs=1e-12)
