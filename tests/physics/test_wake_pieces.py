"""Pieces of the discrete-vortex wake and of the coefficient laws, one by one: formulas term by term, means, merging, motions, limits."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch
from rigs import arm

from nnhydro.errors import ConfigError
from nnhydro.physics.coefficients import aspect_ratio, reynolds
from nnhydro.physics.coefficients.table import interpolate_log
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.bearing_friction import bearing_torque
from nnhydro.physics.loads.history_force import HistoryForce
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.vortex_wake.choices import SEPARATION_ONSET, WakeChoices
from nnhydro.physics.vortex_wake.coefficients import _on_grid, coefficients_across_motions, vortex_coefficients
from nnhydro.physics.vortex_wake.kinematics import power_start, sampled_motion
from nnhydro.physics.vortex_wake.separation import circulation_flux, separation_angle, surface_speed
from nnhydro.physics.vortex_wake.simulation import _steps, simulate_wake
from nnhydro.physics.vortex_wake.wake import Wake, merge, wake_velocities, without_absorbed

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


def test_a_vortex_is_born_an_offset_above_the_wall_with_what_was_shed_in_the_step():
    history = simulate_wake(power_start(3.0, 1.0), 0.1, 0.5, CHOICES)
    dt = np.diff(np.sqrt(2 * np.linspace(0, 0.05, 26) / 3))
    assert len(history.t) == 25
    assert (history.vortices[np.isnan(history.separation)] == 0).all()
    flux = np.diff(np.append(0.0, history.shed)) / dt
    assert (flux[: int(np.isnan(history.separation).sum())] == 0).all()
    np.testing.assert_allclose(history.circulation * history.U * 0.1, history.shed, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(history.s_over_D, 0.5 * 3 * history.t**2 / 0.1, rtol=1e-12)
    np.testing.assert_allclose(history.dU, 3.0)


@pytest.mark.parametrize(("travel", "count"), [(1.0, 50), (1.001, 51), (0.005, 1), (0.1, 5)])
def test_steps_are_equal_in_travel_and_their_middles_equal_in_time(travel, count):
    steps = _steps(power_start(3.0, 1.0), 0.2, travel, CHOICES)
    assert len(steps) == count
    for k, step in enumerate(steps):
        s = 0.2 * travel * np.array([k, k + 1]) / count
        t = np.sqrt(2 * s / 3)
        assert (step.t, step.t_end, step.t_middle) == pytest.approx((t[0], t[1], t.mean()))
        assert step.s_middle == pytest.approx(1.5 * t.mean() ** 2)
        assert step.s_first_half == pytest.approx(step.s_middle - s[0])
        assert step.length == pytest.approx(s[1] - s[0])


@pytest.mark.parametrize("n", [0.0, 0.5, 1.0, 3.0])
def test_a_power_of_time_is_consistent_with_itself(n):
    motion, t, h = power_start(2.0, n), np.array([0.3, 1.1]), 1e-6
    np.testing.assert_allclose((motion.travel(t + h) - motion.travel(t - h)) / (2 * h), motion.speed(t), rtol=1e-6)
    np.testing.assert_allclose((motion.speed(t + h) - motion.speed(t - h)) / (2 * h), motion.acceleration(t), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(motion.time_at(motion.travel(t)), t)
    assert (power_start(2.0, 0.0).acceleration(np.array([0.0, 1.0])) == 0).all()


def test_a_sampled_motion_starts_counting_at_its_first_sample_and_may_start_with_a_jump():
    t = np.linspace(5.0, 7.0, 41)
    motion = sampled_motion(t, 0.5 + 0.4 * (t - 5.0))
    x = np.array([0.2, 1.3])
    np.testing.assert_allclose(motion.speed(x), 0.5 + 0.4 * x, rtol=1e-9)
    np.testing.assert_allclose(motion.travel(x), 0.5 * x + 0.2 * x**2, rtol=1e-9)
    np.testing.assert_allclose(motion.acceleration(x), 0.4, rtol=1e-6)
    np.testing.assert_allclose(motion.time_at(motion.travel(x)), x, atol=1e-12)
    assert motion.farthest == pytest.approx(1.8)
    sampled_motion([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 1.0, 1.0])
    for U in ([0.0, 0.0, 1.0, 1.0], [-0.1, 1.0, 1.0, 1.0], [0.0, 1.0, 1.0, 0.0]):
        with pytest.raises(ConfigError, match="must stay positive after the start"):
            sampled_motion([0.0, 1.0, 2.0, 3.0], U)
    with pytest.raises(ConfigError, match="4 samples or more"):
        sampled_motion([0.0, 1.0, 2.0], [0.0, 1.0, 1.0])


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


@pytest.mark.parametrize(("changes", "fine"), [
    ({"step": 0.1}, True), ({"step": 0.1001}, False), ({"step": 0.0}, False), ({"core": 0.0}, False), ({"core": 1e-3}, True),
    ({"survival": 1.0}, True), ({"survival": 1.001}, False), ({"survival": 0.0}, True), ({"offset": 0.001}, False),
    ({"offset": 0.0011}, True), ({"separation_onset": 0.0}, False), ({"merge_distance": 0.0}, True), ({"merge_distance": -1e-9}, False),
])
def test_choices_are_taken_within_their_ranges_and_refused_beyond(changes, fine):
    if fine:
        assert vars(replace(CHOICES, **changes)).items() >= changes.items()
    else:
        with pytest.raises(ConfigError):
            replace(CHOICES, **changes)


@pytest.mark.parametrize(("law", "points"), [
    (reynolds.drag_coefficient, ((1e2, 1.4), (2e2, 1.27), (9e2, 0.96), (2.3e3, 0.89), (5e3, 0.94), (1.5e4, 1.14), (1e5, 1.17))),
    (lambda Re: reynolds.drag_coefficient(Re, True), ((1.5e4, 1.14), (5e4, 0.8), (6e4, 0.8), (2e5, 1.02), (8e5, 1.08))),
    (aspect_ratio.drag_coefficient, ((1.0, 0.61), (2.0, 0.69), (5.0, 0.74), (10.0, 0.82), (20.0, 0.93))),
    (aspect_ratio.added_mass_coefficient, ((1.2, 0.62), (2.5, 0.78), (5.0, 0.90), (9.0, 0.96))),
], ids=["Re smooth", "Re rough", "L/D drag", "L/D mass"])
def test_between_two_published_points_a_law_follows_the_logarithm_and_beyond_the_first_it_stays(law, points):
    for (a, u), (b, v) in pairwise(points):
        if (a, b) != (2.0, 5.0):  # a point lies between them
            assert float(law(tensor([np.sqrt(a * b)]))[0]) == pytest.approx((u + v) / 2, abs=1e-6)
    (a, u), (b, v) = points[0], points[1]
    assert float(interpolate_log(tensor([np.sqrt(a * b)]), (a, b), (u, v))[0]) == pytest.approx((u + v) / 2)
    assert float(interpolate_log(tensor([a / 7]), (a, b), (u, v))[0]) == u
    assert float(interpolate_log(tensor([b * 7]), (a, b), (u, v))[0]) == v


def test_the_history_force_of_a_towed_link_acts_in_its_middle_and_grows_as_the_root_of_time():
    a, t = arm(1), np.linspace(0, 2, 81)
    still = np.zeros((81, 1))
    motion = Motion(tensor(t), tensor(still), tensor(still), tensor(still), tensor(0.7 * t), tensor(np.full(81, 0.7)))
    force, moment = HistoryForce.at_start(a).loads(Flow(a, motion))
    per_metre = 2 * 1000.0 * 0.07 * np.sqrt(np.pi * a.fluid.kinematic_viscosity_m2_s) * 0.7 * 2 * np.sqrt(t)
    np.testing.assert_allclose(force[:, 0], per_metre * 0.55, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(moment, force * 0.55 / 2, rtol=1e-12)


def test_the_bearing_turns_from_its_constant_to_its_growing_law_where_both_agree():
    n = torch.tensor([0.0, 1.0, 60.0, 2000 / 30 - 1e-9, 2000 / 30 + 1e-9, 500.0], dtype=torch.float64)
    told = bearing_torque(2.0, 30.0, 30.0, n).numpy()
    low = 160e-10 * 2 * 30**3
    np.testing.assert_allclose(told[:4], low)
    np.testing.assert_allclose(told[4:], [1e-10 * 2 * 30**3 * (30 * x) ** (2 / 3) for x in (2000 / 30, 500.0)], rtol=1e-6)
