"""Acceleration from torque, and a step in time."""

import numpy as np
import pytest
import torch

from nnhydro.dynamics.inertia import acceleration, least_inertia, least_slope, mass_and_bias, runge_kutta_step, solve_inertia, tangent
from nnhydro.errors import ModelError

MASS = torch.tensor([[[2.0, 0.5], [0.5, 1.0]], [[3.0, -0.2], [-0.2, 0.7]]], dtype=torch.float64)
BIAS = torch.tensor([[0.3, -1.0], [2.0, 0.1]], dtype=torch.float64)


def affine(qdd):
    """tau = M qdd + h, a mass and a bias for each of two states."""
    return torch.einsum("mij,mkj->mki", MASS, qdd) + BIAS[:, None, :]


def stiffening(qdd):
    """An inertia that grows with the acceleration, as a learned torque may have it."""
    return affine(qdd) + 0.1 * qdd**3


def test_mass_and_bias_of_an_affine_torque_are_its_own():
    mass, bias = mass_and_bias(affine, BIAS)
    torch.testing.assert_close(mass, MASS)
    torch.testing.assert_close(bias, BIAS)


def test_the_tangent_is_the_slope_of_each_torque_over_each_acceleration():
    qdd = torch.tensor([[1.0, -2.0], [0.5, 3.0]], dtype=torch.float64)
    torch.testing.assert_close(tangent(stiffening, qdd), MASS + torch.diag_embed(0.3 * qdd**2), rtol=1e-7, atol=1e-7)


def kinked(qdd):
    """tau = M qdd, less a learned part that saturates at a small acceleration of either sign."""
    return affine(qdd) - torch.tensor([0.0, 2.0]) * (qdd + 0.1).clamp(0.0, 0.2)


def test_over_large_accelerations_a_torque_with_a_kink_has_the_inertia_of_a_mass_and_only_small_ones_meet_the_kink():
    rest = torch.zeros(2, 2, dtype=torch.float64)
    assert bool((least_inertia(tangent(kinked, rest)) < 0).all())
    assert bool((least_inertia(tangent(kinked, rest, torch.tensor([2.0, 3.0], dtype=torch.float64))) > 0.3).all())
    assert bool((least_slope(kinked, rest + 5.0, 1.0) > 0).all())
    assert bool((least_slope(kinked, rest + 0.5, 1.0) < 0).all())


@pytest.mark.parametrize("sign", [1, -1])
def test_a_torque_that_falls_on_one_side_of_rest_alone_is_seen_from_either_side(sign):
    def one_sided(qdd):
        return affine(qdd) - 4.0 * sign * (sign * qdd).clamp(0.0, 0.2)

    assert bool((least_slope(one_sided, torch.full((2, 2), -0.5 * sign, dtype=torch.float64), 1.0) < 0).all())


@pytest.mark.parametrize("torque", [affine, stiffening])
def test_the_acceleration_found_gives_the_torque_asked_for(torque):
    tau = torch.tensor([[5.0, -3.0], [-20.0, 8.0]], dtype=torch.float64)
    qdd = acceleration(torque, tau, torch.zeros(2, 2, dtype=torch.float64))
    torch.testing.assert_close(torque(qdd[:, None, :])[:, 0], tau, rtol=1e-10, atol=1e-10)


def test_without_inertia_and_without_an_answer_there_is_no_acceleration():
    with pytest.raises(ModelError, match="no inertia that a torque could accelerate"):
        solve_inertia(torch.zeros(1, 2, 2, dtype=torch.float64), torch.ones(1, 2, dtype=torch.float64))
    with pytest.raises(ModelError, match="no acceleration gives this torque"):
        acceleration(lambda qdd: torch.tanh(qdd) + 1e-3 * qdd.sin(), torch.full((1, 1), 1.5, dtype=torch.float64),
                     torch.zeros(1, 1, dtype=torch.float64))


def test_a_step_is_of_the_fourth_order():
    """The oscillator q'' = -q from q = 1 at rest: q(1) = cos 1."""
    def error(steps):
        q, qd = np.array([1.0]), np.array([0.0])
        for _ in range(steps):
            q, qd, _ = runge_kutta_step(lambda k, q, qd, near: -q, q, qd, 1 / steps)
        return abs(q[0] - np.cos(1.0))

    assert 3.8 < np.log2(error(10) / error(20)) < 4.2
