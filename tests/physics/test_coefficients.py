"""Coefficient curves and laws: golden curve, tables where they are read, limits, and how laws compose."""

from itertools import pairwise

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from mclain import golden, swing
from rigs import arm, assert_close, run, states

from nnhydro.errors import ModelError
from nnhydro.physics.coefficients import aspect_ratio, keulegan_carpenter, reynolds, travel_bspline, travel_spline
from nnhydro.physics.coefficients.law import StripState, factors, law_kinds, law_of
from nnhydro.physics.coefficients.parallel_distance import proximity
from nnhydro.physics.coefficients.table import interpolate, interpolate_log
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.travel_drag import StateDrag
from nnhydro.physics.motion import tensor
from nnhydro.physics.travel.state_model import state_loads

CURVES = golden("curves")
ORDINATES = {"Cd": [*CURVES["parameters"]["d1..d5"], CURVES["parameters"]["ds"]],
             "Cm": [*CURVES["parameters"]["m1..m5"], CURVES["parameters"]["ms"]]}
START = {"Cd": 0.0, "Cm": 1.0}


def state(a, motion):
    return StateDrag.at_start(a).state(Flow(a, motion))


@pytest.mark.parametrize("name", ["Cd", "Cm"])
def test_the_spline_is_the_golden_curve(name):
    s = tensor(CURVES["s_over_D"]).requires_grad_()
    curve = travel_spline.curve(s, 8.0, START[name], tensor(ORDINATES[name]))
    assert_close(curve, tensor(CURVES[name]), rtol=0, atol=1e-12)
    (slope,) = torch.autograd.grad(curve.sum(), s)
    assert_close(slope, tensor(CURVES[f"d{name}_ds"]), rtol=0, atol=1e-12)


def test_the_spline_agrees_with_the_polynomials_of_the_golden_file():
    for name in ("Cd", "Cm"):
        for k, c in enumerate(CURVES["polynomial_coefficients_per_interval_c0_c1_c2_c3_in_(s/D-knot)"][name]):
            s = torch.linspace(0, 8 / 6, 7, dtype=torch.float64)
            wanted = sum(c[p] * s**p for p in range(4))
            assert_close(travel_spline.curve(s + k * 8 / 6, 8.0, START[name], tensor(ORDINATES[name])), wanted, rtol=0, atol=1e-12)


def test_the_peak_and_the_minimum_lie_where_the_text_puts_them():
    s = torch.linspace(0, 10, 100001, dtype=torch.float64)
    drag, mass = (travel_spline.curve(s, 8.0, START[n], tensor(ORDINATES[n])) for n in ("Cd", "Cm"))
    assert float(s[drag.argmax()]) == pytest.approx(CURVES["Cd_peak"]["at"], abs=1e-3)
    assert float(drag.max()) == pytest.approx(CURVES["Cd_peak"]["value"], abs=1e-6)
    assert float(s[mass.argmin()]) == pytest.approx(CURVES["Cm_min"]["at"], abs=1e-3)


@given(tau_s=st.floats(1.0, 40.0), seed=st.integers(0, 100))
def test_ordinates_are_the_curves_own_values_and_it_is_constant_beyond(tau_s, seed):
    c = tensor(np.random.default_rng(seed).uniform(-1, 2, 6))
    knots = torch.arange(1, 7, dtype=torch.float64) * tau_s / 6
    assert_close(travel_spline.curve(knots, tau_s, 0.7, c), c)
    beyond = travel_spline.curve(torch.tensor([tau_s, 1.5 * tau_s, 1e9, torch.inf], dtype=torch.float64), tau_s, 0.7, c)
    assert_close(beyond, c[-1].expand(4))
    assert_close(travel_spline.curve(torch.zeros(1, dtype=torch.float64), tau_s, 0.7, c), tensor([0.7]))


@pytest.mark.parametrize("count", [1, 2, 3, 8, 20])
def test_b_splines_sum_to_one_start_where_they_must_and_end_level(count):
    s = torch.linspace(0, 12, 500, dtype=torch.float64)
    total = travel_bspline.basis(s, 10.0, count).sum(-1) + travel_bspline.rest_curve(s, 10.0, count)
    assert_close(total, torch.ones_like(s))
    c = torch.arange(1, count + 1, dtype=torch.float64)
    ends = travel_bspline.curve(tensor([0.0, 10.0, torch.inf]), 10.0, 0.3, c)
    assert_close(ends, tensor([0.3, float(count), float(count)]))


def test_bends_of_a_straight_line_of_coefficients_vanish_but_at_the_level_end():
    D, d = travel_bspline.bends(5, 1.0)
    bent = D @ tensor([2.0, 3.0, 4.0, 5.0, 6.0]) + d
    assert_close(bent, tensor([0.0, 0.0, 0.0, 0.0, -1.0]))


TABLES = [(reynolds.drag_coefficient, reynolds.SMOOTH), (aspect_ratio.drag_coefficient, aspect_ratio.C_D),
          (aspect_ratio.added_mass_coefficient, aspect_ratio.C_M), (keulegan_carpenter.drag_ratio, keulegan_carpenter.DRAG_SMOOTH),
          (keulegan_carpenter.added_mass_coefficient, keulegan_carpenter.ADDED_MASS_SMOOTH)]


@pytest.mark.parametrize(("law", "table"), TABLES)
def test_a_law_goes_through_its_table_and_is_constant_outside(law, table):
    at, values = map(tensor, zip(*table, strict=True))
    assert_close(law(at), values)
    assert_close(law(tensor([at[0] / 100, at[-1] * 100, torch.inf])), values[[0, -1, -1]])


@given(x=st.floats(1e-9, 1e9))
def test_interpolation_stays_within_its_neighbours(x):
    at, values = (1.0, 10.0, 1000.0), (3.0, 1.0, 2.0)
    for interpolated in (interpolate, interpolate_log):
        assert 1.0 <= float(interpolated(tensor([x]), at, values)) <= 3.0


def test_the_drag_crisis_is_there_and_roughness_brings_it_forward():
    Re = tensor([1e5, 3e5, 5e5, 3e6])
    smooth, rough = reynolds.drag_coefficient(Re), reynolds.drag_coefficient(Re, rough=True)
    assert smooth[2] < 0.35 < smooth[1]
    assert smooth[3] > 0.6
    assert (rough[1:] > smooth[1:]).all()
    assert reynolds.drag_coefficient(tensor([5e4]), rough=True) < reynolds.drag_coefficient(tensor([5e4])) - 0.3


def test_slender_arms_drag_like_infinite_cylinders_short_ones_less():
    ratio = aspect_ratio.drag_coefficient(tensor([1.0, 5.0, 9.2, 15.0, 1e4])) / aspect_ratio.drag_coefficient(tensor([1e4]))
    assert (ratio.diff() > 0).all()
    assert 0.6 < float(ratio[2]) < 0.8


def test_links_far_apart_do_not_feel_each_other():
    assert_close(proximity(tensor([0.0, 1.0, 3.5, 10.0])), tensor([1.0, 1.0, 0.0, 0.0]))


@pytest.mark.parametrize("kind", law_kinds())
@pytest.mark.parametrize("links", [1, 2, 3])
@pytest.mark.parametrize("motion", [run, states])
def test_every_law_gives_finite_positive_factors_for_every_strip(kind, links, motion):
    here = state(arm(links), motion(links))
    for factor in factors([kind], here):
        whole = factor.expand_as(here.strips.w)
        assert torch.isfinite(whole).all()
        assert (whole > 0).all()


def test_laws_multiply():
    here = state(arm(2), run(2))
    one, other = factors(["aspect_ratio"], here), factors(["constant=0.5"], here)
    both = factors(["aspect_ratio", "constant=0.5"], here)
    for k in range(2):
        assert_close(both[k], one[k] * other[k])
    assert all(float(f.mean()) == 1.0 for f in factors([], here))


def test_a_stretched_arm_is_not_shielded_a_folded_one_is():
    motion = states(2, rows=2)
    motion.q[:, 1] = tensor([0.0, np.pi])
    drag, _ = factors(["inter_link_angle=0.4"], state(arm(2), motion))
    assert_close(drag[:, :, 0], tensor([[1.0, 1.0], [1.0, 0.6]]))
    apart = factors(["inter_link_angle=0.4"], state(arm(2, parallel_distance_m=1.0), motion))[0]
    assert_close(apart, torch.ones_like(apart))
    near, far = (factors(["parallel_distance=0.2"], state(arm(2, parallel_distance_m=h), motion))[0] for h in (0.0, 1.0))
    assert_close(near, torch.full_like(near, 1.2))
    assert_close(far, torch.ones_like(far))


def test_KC_of_a_swing_is_two_pi_amplitude_over_diameter():
    t = np.linspace(0, 6, 3001)
    flow = swing(t, 0.3 * (1 - np.cos(np.pi * t)), 0.3 * np.pi * np.sin(np.pi * t), 0.3 * np.pi**2 * np.cos(np.pi * t))
    here = StateDrag.at_start(flow.arm).state(flow)
    wanted = 2 * np.pi * 0.3 * here.strips.x / 0.071
    assert_close(here.KC[-100], wanted, rtol=1e-3, atol=0.12)  # a reversal counts after 0.03 D


def test_local_Reynolds_numbers_are_speed_times_diameter_over_viscosity():
    here = state(arm(1), run(1))
    assert_close(here.Re, here.strips.w.abs() * 0.07 / 1e-6)
    assert isinstance(here, StripState)


@pytest.mark.parametrize("text", ["reynold", "aspect_ratio=2", "constant=much", ""])
def test_an_unknown_law_or_number_is_refused(text):
    with pytest.raises(ModelError, match="law"):
        law_of(text)


def test_laws_act_in_the_terms_and_survive_storage():
    a, motion = arm(2), run(2)
    plain, halved = StateDrag.at_start(a), StateDrag.at_start(a, laws=["constant=0.5"])
    assert_close(halved.torque(Flow(a, motion)), 0.5 * plain.torque(Flow(a, motion)))
    carried = state_loads(a, laws=("constant=0.5",)), state_loads(a)
    for name in ("state_added_mass", "state_at_rest"):
        some, whole = (loads.terms[name].torque(Flow(a, motion)) for loads in carried)
        assert_close(some, 0.5 * whole)
        assert float(whole.abs().max()) > 0.01
    with pytest.raises(ModelError, match="coefficient law"):
        StateDrag.at_start(a, laws=("no_such",))


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
