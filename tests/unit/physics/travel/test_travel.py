"""The travel of each strip since its start or reversal: closed forms, rules, and what may never happen."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from mclain import golden, golden_slew, swing
from rigs import arm, assert_close, mirrored_about_X, mirrored_about_Y, run, states

from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.travel import RULES, TravelRule, travel


def swinging(rows=2001, amplitude=1.0, periods=2.0, T=2.0):
    """One link, angle amplitude (1 - cos): at rest at 0, T/2, T, ..."""
    t = np.linspace(0.0, periods * T, rows)
    w = 2 * np.pi / T
    return swing(t, amplitude * (1 - np.cos(w * t)), amplitude * w * np.sin(w * t), amplitude * w**2 * np.cos(w * t))


def of(flow, **rule):
    return travel(Strips.of(flow), TravelRule(**rule))


@pytest.mark.parametrize("number", range(3))
def test_on_a_slew_the_travel_is_the_arc(number):
    flow = golden_slew(golden("slews")["slews"][number])
    strips = Strips.of(flow)
    assert_close(travel(strips), strips.x * flow.motion.q[:, :, None])


def test_after_a_reversal_the_travel_is_the_arc_since_then():
    flow = swinging()
    strips, q = Strips.of(flow), flow.motion.q[:, :, None]
    wanted = strips.x * (2.0 - q)
    back = ((flow.motion.t > 1.0) & (flow.motion.t <= 2.0))[:, None, None] & (wanted > 0.04 * 0.071)  # the reversal counts by then
    assert_close(travel(strips)[back], wanted[back], atol=1e-6)  # the row of rest is found to rounding, not exactly


def test_kept_travel_is_the_whole_path():
    flow = swinging(periods=1.0)
    assert_close(of(flow, at_reversal="keep")[-1], 4.0 * Strips.of(flow).x / 1.0, rtol=1e-5)


def test_a_reversal_between_two_rows_is_placed_where_the_velocity_vanishes():
    t = np.array([0.0, 1.0, 2.0, 3.0])
    strips = Strips.of(swing(t, [0.0, 0.5, 0.5, -0.5], [0.0, 1.0, -1.0, -1.0], [0.0] * 4))
    s = travel(strips)
    assert_close(s[2], 0.25 * strips.x)  # a triangle of half a second and 1 rad/s
    assert_close(s[3], 1.25 * strips.x)


def test_the_two_sides_of_the_zero_velocity_point_reverse_on_their_own():
    """Carriage at 0.3 m/s from rest, arm swings back: inner strips go on, outer ones turn round."""
    t = np.linspace(0, 2, 401)
    u0, omega = np.minimum(t, 0.3), -np.maximum(t - 1.0, 0.0)
    theta = -np.maximum(t - 1.0, 0.0) ** 2 / 2
    a = arm(1)
    flow = Flow(a, Motion(tensor(t), tensor(theta)[:, None], tensor(omega)[:, None], tensor(-(t > 1.0).astype(float))[:, None],
                          tensor(u0), torch.zeros(401, dtype=torch.float64)))
    strips = Strips.of(flow)
    s = travel(strips)
    assert strips.w[-1, 0, 0] > 0 > strips.w[-1, 0, -1]
    assert s[-1, 0, 0] > 0.4
    assert s[-1, 0, -1] < 0.2
    assert 0 < s[-1, 0].argmin() < 9, "the strip that reversed last has travelled least"


def test_decay_begins_at_keep_and_ends_at_reset():
    flow = swinging(amplitude=2.0)
    reset, keep = of(flow), of(flow, at_reversal="keep")
    assert_close(of(flow, at_reversal="decay", memory=1e9), keep, rtol=1e-6, atol=1e-6)
    assert_close(of(flow, at_reversal="decay", memory=1e-3)[reset > 0.01], reset[reset > 0.01], atol=1e-3)
    middle = of(flow, at_reversal="decay", memory=5.0)
    assert (middle >= reset - 1e-12).all()
    assert (middle <= keep + 1e-12).all()


def test_a_pause_restarts_the_travel_only_where_the_water_may_come_to_rest():
    t = np.linspace(0, 4, 801)
    rate = np.where(t < 1, np.sin(np.pi * t) ** 2, np.where(t > 3, np.sin(np.pi * (t - 3)) ** 2, 0.0))
    theta = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(t))])
    flow = swing(t, theta, rate, np.gradient(rate, t))
    x = Strips.of(flow).x
    assert_close(of(flow)[-1], 1.0 * x, rtol=1e-6)
    assert_close(of(flow, dwell_s=1.0)[-1], 0.5 * x, rtol=1e-3, atol=1e-3)
    assert_close(of(flow, dwell_s=10.0)[-1], 1.0 * x, rtol=1e-6)


def test_noise_about_rest_is_no_reversal():
    t = np.linspace(0, 4, 801)
    rate = np.where(t < 2, np.sin(np.pi * t / 2) ** 2, 1e-4 * np.sin(300 * t))
    flow = swing(t, np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(t))]), rate, 0 * t)
    assert (of(flow)[-1] >= 1.0 * Strips.of(flow).x - 1e-9).all()


def test_steady_rows_have_travelled_for_ever():
    assert torch.isinf(of(Flow(arm(2), states(2)))).all()


@pytest.mark.parametrize("rule", RULES)
def test_a_recording_that_begins_in_motion_is_steady_until_it_reverses(rule):
    t = np.linspace(0, 3, 301)
    flow = swing(t, t - t**2 / 2 / 1.5, 1 - t / 1.5, np.full(301, -1 / 1.5))
    s = of(flow, at_reversal=rule)
    assert torch.isinf(s[:140]).all()
    if rule == "reset":
        assert_close(s[-1], 0.75 * Strips.of(flow).x, rtol=1e-2)


@given(seed=st.integers(0, 1000), links=st.integers(1, 3), rule=st.sampled_from(RULES), dwell=st.sampled_from([0.0, 0.2]))
def test_travel_is_never_negative_and_grows_between_restarts(seed, links, rule, dwell):
    flow = Flow(arm(links), run(links, seed=seed))
    s = of(flow, at_reversal=rule, dwell_s=dwell)
    assert (s >= 0).all()
    if rule == "keep" and not dwell:
        assert (s[1:] >= s[:-1] - 1e-12).all()
    if rule == "reset":
        w = Strips.of(flow).w
        shrinks = s[1:] < s[:-1] - 1e-12
        assert (s[1:][shrinks] <= 0.03 * 0.07 + 0.1 * float(w.abs().max())).all(), "where it shrinks it begins anew: rows are 0.1 s apart"


@given(seed=st.integers(0, 1000), rule=st.sampled_from(RULES))
def test_the_mirrored_arm_has_travelled_as_far(seed, rule):
    motion = run(2, seed=seed)
    for mirror in (mirrored_about_X, mirrored_about_Y):
        assert_close(of(Flow(arm(2), mirror(motion)), at_reversal=rule), of(Flow(arm(2), motion), at_reversal=rule), atol=1e-9)


def test_twice_the_samples_change_the_travel_four_times_less():
    final = [float(of(Flow(arm(2), run(2, rows)), at_reversal="keep")[-1].sum()) for rows in (121, 241, 481, 961)]
    steps = np.abs(np.diff(final))
    assert steps[-1] < steps[0] / 8


@pytest.mark.parametrize(("option", "hint"), [({"at_reversal": "forget"}, "reset, keep, decay"), ({"memory": 0.0}, "positive"),
                                              ({"dwell_s": -1.0}, "0 for never")])
def test_an_impossible_rule_is_refused(option, hint):
    with pytest.raises(ModelError, match=hint):
        TravelRule(**option)


def test_a_stop_that_rings_is_no_reversal():
    """The end of a slew swings back by 0.01 D: the travel stays that of the slew, and C_M with it."""
    t = np.linspace(0, 2, 2001)
    ring = np.where(t > 1, np.exp(-8 * (t - 1)) * np.sin(40 * (t - 1)), 0.0) * 0.01 * 0.071 / 0.65
    theta = np.where(t < 1, t**2 * (3 - 2 * t), 1.0) + ring
    rate = np.gradient(theta, t)
    flow = swing(t, theta, rate, np.gradient(rate, t))
    s, x = of(flow), Strips.of(flow).x
    assert (rate < -1e-3).any()
    assert (s[t > 1] >= 0.99 * x).all()
    assert_close(of(flow, at_reversal="decay"), of(flow, at_reversal="keep"))
