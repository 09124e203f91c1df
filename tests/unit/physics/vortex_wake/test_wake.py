"""Vortices move, grow old, become one and are absorbed."""

from dataclasses import replace

import numpy as np
import pytest

from nnhydro.physics.vortex_wake.choices import WakeChoices
from nnhydro.physics.vortex_wake.wake import Wake, merge, wake_velocities, without_absorbed

CHOICES = WakeChoices()
Z = np.array([-1.3 + 0.9j, -0.4 + 1.4j, -2.0 + 0.5j])
GAMMA = np.array([0.7, 0.3, 1.1])
CORE = np.array([0.3, 0.5, 0.2])


def test_vortices_move_by_the_stream_by_each_other_and_by_all_images():
    U, c = 1.5, 0.8
    told = wake_velocities(Wake(Z, GAMMA, np.zeros(3)), U, c, CORE)
    for k, zk in enumerate(Z):
        total = U * c**2 / zk**2
        for j, zj in enumerate(Z):
            blur = (CORE[k] ** 2 + CORE[j] ** 2) / 2

            def smooth(r, blur=blur):
                return np.conj(r) / (abs(r) ** 2 + blur)
            total -= 0.5j / np.pi * GAMMA[j] * (smooth(zk - zj) - smooth(zk - np.conj(zj)) - 1 / (zk - c**2 / np.conj(zj))
                                                + 1 / (zk - c**2 / zj))
        assert told[k] == pytest.approx(np.conj(total), rel=1e-12)


def test_cores_grow_with_age_by_viscosity_and_not_before_birth():
    wake = Wake(Z, GAMMA, np.array([0.0, 1.0, 5.0]))
    cores = wake.cores(3.0, 0.1, replace(CHOICES, kinematic_viscosity_m2_s=1e-4))
    np.testing.assert_allclose(cores, np.sqrt(0.008**2 + 4e-4 * np.array([3.0, 2.0, 0.0])))
    z, gamma = wake.whole()
    np.testing.assert_array_equal(z, [*Z, *np.conj(Z)])
    np.testing.assert_array_equal(gamma, [*GAMMA, *-GAMMA])


def test_neighbours_in_the_order_of_shedding_become_one_where_both_are_far_and_near_to_each_other():
    z = np.array([-3 + 1j, -3.01 + 1j, -0.9 + 0.2j, -0.91 + 0.2j, -3 + 2j, -3.5 + 2j, -4 + 1j])
    gamma, born = np.array([1.0, 3.0, 1, 1, 1, 1, 9]), np.arange(7.0)
    told = merge(Wake(z, gamma, born), 0.05, 2.0)
    np.testing.assert_allclose(told.z, [(z[0] + 3 * z[1]) / 4, *z[2:]])
    np.testing.assert_allclose(told.Gamma, [4.0, *gamma[2:]])
    np.testing.assert_allclose(told.born, [0.75, *born[2:]])
    wake = Wake(z, gamma, born)
    assert merge(wake, 0.0, 2.0) is wake
    assert merge(wake, 0.05, 5.0) is wake
    single = Wake(z[:1], gamma[:1], born[:1])
    assert merge(single, 9.0, 0.0) is single
    opposite = Wake(z[:2], np.array([1.0, -1.0]), born[:2])
    assert merge(opposite, 9.0, 0.0) is opposite


def test_vortices_at_the_wall_or_across_the_axis_are_absorbed():
    wake = Wake(np.array([1.05j, 1.2j, 2 + 0j, 2 - 0.1j, 2 + 0.1j]), np.ones(5), np.zeros(5))
    np.testing.assert_array_equal(without_absorbed(wake, 1.0, 0.1).z, [1.2j, 2 + 0.1j])
    whole = Wake(np.array([1.2j]), np.ones(1), np.zeros(1))
    assert without_absorbed(whole, 1.0, 0.1) is whole
