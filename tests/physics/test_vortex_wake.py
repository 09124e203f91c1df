"""Claims about the discrete-vortex model: golden values, pressure integrals, limits, momentum, similarity, convergence."""

import json
from pathlib import Path

import numpy as np
import pytest
from potential_flow import complex_pairs, random_flow, transverse_force, velocity, vortex_velocities
from scipy.integrate import solve_bvp

from nnhydro.errors import ConfigError
from nnhydro.physics.vortex_wake import (
    WakeChoices,
    coefficients_across_motions,
    constant_acceleration,
    power_start,
    sampled_motion,
    simulate_wake,
    vortex_coefficients,
)
from nnhydro.physics.vortex_wake.choices import SEPARATION_ONSET
from nnhydro.physics.vortex_wake.separation import surface_speed
from nnhydro.physics.vortex_wake.wake import Wake, merge, wake_velocities

GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "potential_flow.json").read_text())
GOLDEN_REL = 1e-10  # stated in the golden file
RHO = 1000.0


# -- golden values -----------------------------------------------------------------------------------------------------------------
def test_a_mirrored_pair_of_the_golden_file_moves_in_the_simulation_as_it_does_there():
    case = GOLDEN["cases"][0]
    z, Gamma = complex_pairs(case["z_k"]), np.array(case["Gamma_k"])
    assert (z[1], Gamma[1]) == (np.conj(z[0]), -Gamma[0])
    moved = wake_velocities(Wake(z[:1], Gamma[:1], np.zeros(1)), case["U"], case["c"], np.full(1, 1e-12))  # no core to speak of
    assert moved == pytest.approx(np.array([complex(case["u_k_lab"][0], case["v_k"][0])]), rel=GOLDEN_REL)


# -- the flow and its force, against an independent pressure integral ----------------------------------------------------------------
def test_a_mirrored_wake_has_no_lift_and_moves_as_a_mirrored_wake():
    c, U, _, z, Gamma, dGamma = random_flow(3)
    z = z.real + 1j * np.abs(z.imag)
    both, strengths, rates = np.append(z, z.conj()), np.append(Gamma, -Gamma), np.append(dGamma, -dGamma)
    v = vortex_velocities(U, c, both, strengths)
    assert v[5:] == pytest.approx(np.conj(v[:5]), rel=1e-12)
    assert transverse_force(RHO, c, U, both, strengths, v, rates) == pytest.approx(0.0, abs=1e-9)


def test_the_mirrored_half_without_core_moves_like_the_whole_wake():
    c, U, _, z, Gamma, _ = random_flow(4)
    wake = Wake(z.real + 1j * np.abs(z.imag), Gamma, np.zeros(5))
    whole = vortex_velocities(U, c, *wake.whole())
    tiny = np.full(5, 1e-9)  # m: the core enters squared, 1e-18 against 1e-3
    assert wake_velocities(wake, U, c, tiny) == pytest.approx(whole[:5], rel=1e-9)
    theta = np.array([0.4, 1.2, 2.5])
    at_wall = velocity(c * np.exp(1j * theta), U, c, *wake.whole()) - U
    past = (np.conj(1j * np.exp(1j * theta)) * at_wall).real
    assert surface_speed(theta, U, c, tiny, wake.z, wake.Gamma) == pytest.approx(past, rel=1e-9)


def test_the_core_adds_no_force_between_vortices():
    c, _, _, z, Gamma, _ = random_flow(5)
    wake, core = Wake(1e4 * (z.real + 1j * np.abs(z.imag)), Gamma, np.zeros(5)), 100.0 * np.arange(1.0, 6.0)  # far: no images
    v = wake_velocities(wake, 0.0, c, core)
    assert np.sum(Gamma * v.imag) == pytest.approx(0.0, abs=1e-9 * np.abs(Gamma * v.imag).max())


# -- the simulation ------------------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def start():
    return simulate_wake(constant_acceleration(3.0), 0.071, 4.0)


def test_separation_begins_where_the_boundary_layer_series_says():
    def layer(x, y):  # u = t V f' + t^3 V V' g, stretched y: Blasius series for a wall set into constant acceleration
        f, f1, f2, g, g1 = y
        return np.vstack([f1, f2, -4 - 2 * x * f2 + 4 * f1, g1, -2 * x * g1 + 12 * g + 4 * (f1**2 - f * f2 - 1)])

    x = np.linspace(0, 6, 200)
    guess = np.zeros((5, 200))
    guess[1] = 1 - np.exp(-x)
    solved = solve_bvp(layer, lambda a, b: np.array([a[0], a[1], b[1] - 1, a[3], b[3]]), x, guess, tol=1e-8, max_nodes=20000)
    shear = solved.y[4, 0] / solved.y[2, 0]  # tau_w ~ 1 + shear t^2 dV/dx
    assert pytest.approx(1 / (8 * shear), rel=1e-4) == SEPARATION_ONSET


def test_the_curves_begin_at_no_drag_and_the_ideal_added_mass():
    curve = vortex_coefficients(1.0)
    assert (curve.s_over_D[0], curve.C_D[0], curve.C_M[0]) == (0.0, 0.0, 1.0)
    attached = curve.history.s_over_D < SEPARATION_ONSET
    assert curve.history.C_D[attached] == pytest.approx(0.0, abs=1e-15)
    assert curve.history.F_X[attached] == pytest.approx(-0.25 * np.pi * RHO * 0.071**2 * 3.0, rel=1e-14)


def test_coefficients_return_the_force(start):
    by_coefficients = -start.C_M * 0.25 * np.pi * RHO * 0.071**2 * start.dU - start.C_D * 0.5 * RHO * 0.071 * start.U**2
    assert by_coefficients == pytest.approx(start.F_X, rel=1e-12)


def test_force_over_time_is_the_loss_of_impulse(start):
    ends = constant_acceleration(3.0).time_at(np.linspace(0, 4 * 0.071, start.t.size + 1))
    given = np.cumsum(start.F_X * np.diff(ends))
    # second-order midpoint rule and vortices absorbed at the wall: a thousandth of the total
    assert given == pytest.approx(-RHO * start.impulse, abs=1e-3 * RHO * start.impulse[-1])


def test_every_bit_of_circulation_is_accounted_for(start):
    assert start.final.Gamma.sum() == pytest.approx(start.shed[-1], rel=1e-12)
    assert (np.abs(start.final.z) > 0.0355).all()
    assert (start.final.z.imag > 0).all()


def test_drag_rises_and_added_mass_falls_as_the_wake_grows():
    curve = vortex_coefficients(4.0)
    assert 1.3 < curve.C_D.max() < 1.7
    assert 1.0 < curve.s_over_D[curve.C_D.argmax()] < 3.0
    assert curve.C_M[-1] < 0.2


@pytest.mark.parametrize(("acceleration", "diameter"), [(0.7, 0.071), (11.0, 0.071), (3.0, 0.3)])
def test_curves_collapse_over_acceleration_and_diameter(acceleration, diameter):
    reference = simulate_wake(constant_acceleration(3.0), 0.071, 3.0)
    other = simulate_wake(constant_acceleration(acceleration), diameter, 3.0)
    assert pytest.approx(reference.C_D, abs=1e-10) == other.C_D  # rounding only
    assert pytest.approx(reference.C_M, abs=1e-10) == other.C_M


def test_viscous_cores_break_the_collapse_by_less_than_a_hundredth():
    water = WakeChoices(kinematic_viscosity_m2_s=1e-6)
    slow, fast = (vortex_coefficients(3.0, water, motion=constant_acceleration(a)) for a in (0.5, 10.0))
    assert 0 < np.abs(slow.C_D - fast.C_D).max() < 0.01


def test_a_sampled_constant_acceleration_gives_the_same_curves():
    t = np.linspace(0, 0.6, 30)
    sampled = simulate_wake(sampled_motion(t, 3.0 * t), 0.071, 3.0)
    exact = simulate_wake(constant_acceleration(3.0), 0.071, 3.0)
    assert pytest.approx(exact.C_D, abs=1e-8) == sampled.C_D


def test_merging_keeps_circulation_and_impulse():
    wake = Wake(np.array([-3 + 1j, -3.01 + 1j, -1 + 0.5j, -5 + 1j]), np.array([1.0, 2.0, 3.0, 4.0]), np.arange(4.0))
    after = merge(wake, 0.05, 2.0)
    assert after.z.size == 3
    assert after.Gamma.sum() == wake.Gamma.sum()
    assert (after.Gamma * after.z).sum() == pytest.approx((wake.Gamma * wake.z).sum(), rel=1e-15)


def test_the_same_arguments_give_the_same_bits():
    reference, two = (simulate_wake(power_start(2.0, 0.0), 0.05, 2.0) for _ in range(2))
    assert (reference.F_X == two.F_X).all()


def test_two_motions_separate_drag_from_inertia():
    curve = coefficients_across_motions((1.0, 2.0), 2.0)
    assert curve.C_M[0] == pytest.approx(1.0, abs=0.02)
    assert (np.diff(curve.C_M) < 0.02).all()
    np.testing.assert_allclose(curve.s_over_D, np.arange(0.5, 2.05, 0.1), err_msg="ten values per diameter, after the first half")


def test_motions_that_nobody_names_are_those_of_speeds_that_grow_ever_later():
    usual, named = coefficients_across_motions(travel=0.6), coefficients_across_motions((1 / 3, 1.0, 3.0), 0.6)
    np.testing.assert_array_equal(usual.C_D, named.C_D)


@pytest.mark.slow
def test_curves_converge_at_first_order_in_the_step():
    coarse, middle, fine = (vortex_coefficients(3.0, WakeChoices(step=step)) for step in (0.04, 0.02, 0.01))
    first, second = (np.sqrt(np.mean((a.C_D - b.C_D) ** 2)) for a, b in ((coarse, middle), (middle, fine)))
    assert second < 0.025
    assert 1.5 < first / second < 3.0


@pytest.mark.slow
def test_merging_far_vortices_leaves_the_curves_alone():
    without, with_it = (vortex_coefficients(7.5, WakeChoices(merge_distance=d)) for d in (0.0, 0.03))
    assert with_it.history.vortices[-1] < without.history.vortices[-1]
    assert np.abs(with_it.C_D - without.C_D).max() < 0.03


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: constant_acceleration(-1.0), "must be positive"),
        (lambda: power_start(1.0, -0.5), r"0 \(impulsive\) or more"),
        (lambda: sampled_motion([0, 1, 2, 3], [0, 1, -1, 1]), "cut the run there"),
        (lambda: sampled_motion([0, 1, 1, 3], [0, 1, 1, 1]), "increase strictly"),
        (lambda: simulate_wake(sampled_motion([0, 1, 2, 3], [0, 1, 1, 1]), 0.5, 9.0), "covers 5.25 diameters, 9 were"),
        (lambda: simulate_wake(constant_acceleration(1.0), 0.0, 1.0), "diameter"),
        (lambda: WakeChoices(step=0.5), "0.02 is usual"),
        (lambda: WakeChoices(core=0.0), "core is 0"),
        (lambda: WakeChoices(offset=0.0), "offset"),
        (lambda: vortex_coefficients(1.0, window=2.0), "window"),
        (lambda: coefficients_across_motions((1.0,)), "two different exponents"),
    ],
)
def test_a_wrong_argument_is_refused_with_its_value_and_a_way_out(call, message):
    with pytest.raises(ConfigError, match=message):
        call()
