"""Where the boundary layer leaves, and what it sheds, term by term."""

from dataclasses import replace

import numpy as np
import pytest

from nnhydro.physics.vortex_wake.choices import SEPARATION_ONSET, WakeChoices
from nnhydro.physics.vortex_wake.separation import circulation_flux, separation_angle, surface_speed

CHOICES = WakeChoices()
Z = np.array([-1.3 + 0.9j, -0.4 + 1.4j, -2.0 + 0.5j])
GAMMA = np.array([0.7, 0.3, 1.1])
CORE = np.array([0.3, 0.5, 0.2])


def speed_by_hand(theta, U, c, core, z, gamma):
    """The sum over vortices and images, term by term."""
    wall, total = c * np.exp(1j * theta), 2 * U * np.sin(theta)
    for zk, g, d in zip(z, gamma, core, strict=True):
        near = 1 / (abs(wall - zk) ** 2 + d**2) - 1 / (abs(wall - np.conj(zk)) ** 2 + d**2)
        total -= g * (abs(zk) ** 2 - c**2) / (2 * np.pi * c) * near
    return total


def test_the_speed_past_the_wall_is_the_sum_over_vortices_and_images():
    theta = np.array([0.3, 1.2, 2.0, 2.9])
    told = surface_speed(theta, 1.5, 0.8, CORE, Z, GAMMA)
    np.testing.assert_allclose(told, [speed_by_hand(a, 1.5, 0.8, CORE, Z, GAMMA) for a in theta], rtol=1e-12)


@pytest.mark.parametrize("reversed_flow", [False, True])
@pytest.mark.parametrize("survival", [1.0, 0.6])
def test_the_flux_is_half_the_square_of_the_speed_six_degrees_ahead_less_that_of_the_reversed_flow(reversed_flow, survival):
    choices = replace(CHOICES, reversed_flow=reversed_flow, survival=survival)
    theta, gamma = 1.7, 6 * GAMMA
    ahead = max(speed_by_hand(theta - np.deg2rad(6.0), 1.5, 0.8, CORE, Z, gamma), 0.0)
    behind = min(*(speed_by_hand(a, 1.5, 0.8, CORE, Z, gamma) for a in np.linspace(theta, np.pi, 26)[1:-1]), 0.0)
    assert behind < -0.01
    flux = survival * max(ahead**2 / 2 - reversed_flow * behind**2 / 2, 0.0)
    assert circulation_flux(theta, 1.5, 0.8, CORE, Z, gamma, choices) == pytest.approx(flux, rel=1e-12)


def test_separation_begins_at_the_onset_at_the_rear_and_moves_towards_the_shoulder():
    assert separation_angle(SEPARATION_ONSET, CHOICES) is None
    assert separation_angle(SEPARATION_ONSET * (1 + 1e-9), CHOICES) == pytest.approx(np.pi, abs=1e-3)
    assert separation_angle(2 * SEPARATION_ONSET, CHOICES) == pytest.approx(2 * np.pi / 3)
    assert separation_angle(1e6, CHOICES) == pytest.approx(np.pi / 2, abs=1e-5)
    assert pytest.approx(1 / (8 * 0.4261), rel=1e-4) == SEPARATION_ONSET
