"""Basset's force on a cylinder: closed forms, the oscillating limit, and that it takes energy."""

from math import pi

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from mclain import swing
from rigs import arm, assert_close, hub_at_rest, run, states
from scipy.special import erf

from nnhydro.effects.hypotheses.history_force import HistoryForceEffect
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.history_force import HistoryForce, half_derivative
from nnhydro.physics.motion import Motion, tensor


def tow(t, u0, du0):
    """One link across the tow: the whole length has the carriage's velocity."""
    still = torch.zeros(len(t), 1, dtype=torch.float64)
    return Flow(arm(1), Motion(tensor(t), still, still, still, tensor(u0), tensor(du0)))


def force_per_metre(flow, decay=()):
    return HistoryForce((1.0,), decay).loads(flow)[0][:, 0] / flow.L


def test_uniform_acceleration_from_rest_has_the_closed_form():
    t = np.linspace(0, 2, 301)
    flow = tow(t, 0.7 * t, np.full(301, 0.7))
    assert_close(force_per_metre(flow), tensor(4 * 1000.0 * 0.07 * np.sqrt(pi * 1e-6 * t) * 0.7))


def test_a_ramp_that_ends_leaves_a_force_that_fades_as_its_closed_form():
    t = np.linspace(0, 4, 401)
    flow = tow(t, 0.7 * np.minimum(t, 1.0), np.where(t < 1, 0.7, 0.0))
    wanted = 4 * 1000.0 * 0.07 * np.sqrt(pi * 1e-6) * 0.7 * (np.sqrt(t) - np.sqrt(np.maximum(t - 1, 0)))
    assert_close(force_per_metre(flow), tensor(wanted), atol=1e-10)


def test_a_layer_that_the_flow_carries_away_comes_to_a_steady_force():
    t = np.linspace(0, 4, 401)
    flow = tow(t, 0.7 * t, np.full(401, 0.7))
    wanted = 2 * 1000.0 * 0.07 * np.sqrt(pi * 1e-6) * 0.7 * np.sqrt(pi / 3.0) * erf(np.sqrt(3.0 * t))
    assert_close(force_per_metre(flow, (3.0,)), tensor(wanted), atol=1e-10)
    assert_close(force_per_metre(flow, (1e-9,)), force_per_metre(flow), rtol=1e-8)


def test_the_hypothesis_fades_as_the_load_does():
    t = np.linspace(0, 4, 401)
    flow = tow(t, 0.7 * t, np.full(401, 0.7))
    effect = HistoryForceEffect(C_H=(1.0,), decay=(3.0,))
    assert_close(effect.torque(flow), HistoryForce((1.0,), (3.0,)).torque(flow))
    assert "It fades at a rate of 3 1/s" in effect.statement()


@pytest.mark.parametrize("decay", [0.0, 2.0])
def test_even_and_uneven_rows_give_the_same_force(decay):
    rng = np.random.default_rng(1)
    t = np.sort(np.concatenate([np.linspace(0, 3, 901), rng.uniform(0, 3, 500)]))
    even = np.linspace(0, 3, 901)
    ours = half_derivative(tensor(t), tensor(np.interp(t, even, np.sin(even)))[:, None], decay)[np.searchsorted(t, even)]
    assert_close(ours, half_derivative(tensor(even), tensor(np.sin(even))[:, None], decay), rtol=1e-9, atol=1e-10)


def test_a_long_oscillation_has_the_phase_and_size_of_stokes_and_wang():
    """In phase with the acceleration the force is 4 (pi beta)^-1/2 of the displaced mass's, and as much in phase with the velocity."""
    T, D, nu = 2.0, 0.07, 1e-6
    t = np.linspace(0, 40 * T, 40 * 400 + 1)
    w = 2 * pi / T
    f = force_per_metre(tow(t, np.sin(w * t), w * np.cos(w * t))).numpy()
    last = t >= 39 * T - 1e-9
    inertia = 2 * np.mean(f[last][:-1] * np.cos(w * t[last][:-1]))
    drag = 2 * np.mean(f[last][:-1] * np.sin(w * t[last][:-1]))
    wanted = 1000.0 * pi * D**2 / 4 * w * 4 / np.sqrt(pi * D**2 / (nu * T))
    assert inertia == pytest.approx(wanted, rel=0.02)
    assert drag == pytest.approx(wanted, rel=0.02)


def test_a_turning_link_has_the_moment_of_a_triangle_of_velocity():
    t = np.linspace(0, 1, 201)
    flow = swing(t, t**2 / 2, t, np.ones(201))
    force, moment = HistoryForce.at_start(flow.arm).loads(flow)
    assert_close(moment, force * 2 / 3 * 0.65)


def test_steady_rows_have_no_history():
    assert not HistoryForce.at_start(arm(2)).torque(Flow(arm(2), states(2))).any()


@given(seed=st.integers(0, 200))
def test_it_never_gives_energy_over_a_run_from_rest_with_the_hub_held(seed):
    motion = hub_at_rest(run(1, rows=600, seed=seed))
    flow = Flow(arm(1), motion)
    power = (HistoryForce.at_start(arm(1)).torque(flow) * motion.qd).sum(1)
    work = torch.cumulative_trapezoid(power, motion.t)
    assert float(work.min()) > -1e-4 * float(work.abs().max())


def test_the_sum_over_rows_converges_at_the_order_of_a_linear_interpolation():
    def at(rows):
        t = np.linspace(0, 1, rows)
        return float(half_derivative(tensor(t), tensor(t**3)[:, None])[-1, 0])

    exact = 16 / 5  # int 3 s^2 / sqrt(1 - s) ds
    errors = [abs(at(rows) - exact) for rows in (51, 101, 201, 401)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert (orders > 1.4).all()


def test_the_history_force_of_a_towed_link_acts_in_its_middle_and_grows_as_the_root_of_time():
    a, t = arm(1), np.linspace(0, 2, 81)
    still = np.zeros((81, 1))
    motion = Motion(tensor(t), tensor(still), tensor(still), tensor(still), tensor(0.7 * t), tensor(np.full(81, 0.7)))
    force, moment = HistoryForce.at_start(a).loads(Flow(a, motion))
    per_metre = 2 * 1000.0 * 0.07 * np.sqrt(np.pi * a.fluid.kinematic_viscosity_m2_s) * 0.7 * 2 * np.sqrt(t)
    np.testing.assert_allclose(force[:, 0], per_metre * 0.55, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(moment, force * 0.55 / 2, rtol=1e-12)
