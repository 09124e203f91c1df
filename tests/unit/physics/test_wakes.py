"""Wakes: drag that lags, wakes that grow, wakes that are met again, shedding."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypotheses import made
from rigs import arm, assert_close, run

from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import term_of
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.wake_memory import overtaking


def test_drag_that_lags_follows_a_step_of_the_tow_exponentially():
    a, t = arm(1), np.linspace(0, 2, 401)
    still = torch.zeros(401, 1, dtype=torch.float64)
    u0 = tensor(np.where(t < 0.5, 0.4, 0.8))
    flow = Flow(a, Motion(tensor(t), still, still, still, u0, torch.zeros_like(u0)))
    change = made("flow_memory", a, share=(1.0,), response=(0.2,)).torque(flow)[:, 0]
    drag = NormalDrag((1.0,)).torque(flow)[:, 0]
    since, step = tensor(np.maximum(t - 0.5, 0)), 0.005 / 0.2
    risen = (drag[0] - drag[-1]) * (1 - np.exp(-step)) / step  # over the row in which the speed grows
    assert_close(change, torch.where(tensor(t) < 0.4999, 0.0, risen * torch.exp(-since / 0.2)), rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("v", [0.3, 1.0])
def test_of_a_velocity_that_lags_the_drag_misses_what_the_present_speed_makes_of_the_rise(v):
    """After a step from u to U, |w|^v (|w|^(1-v) w)' has missed U^v (U^(2-v) - u^(2-v)) where the drag itself misses U^2 - u^2."""
    a, t = arm(1), np.linspace(0, 2, 401)
    still = torch.zeros(401, 1, dtype=torch.float64)
    u, U = 0.4, 0.8
    u0 = tensor(np.where(t < 0.5, u, U))
    flow = Flow(a, Motion(tensor(t), still, still, still, u0, torch.zeros_like(u0)))
    drag, velocity = (made("flow_memory", a, share=(1.0,), response=(0.2,), velocity=(x,)).torque(flow)[:, 0] for x in (0.0, v))
    assert_close(velocity, drag * (U**v * (U ** (2 - v) - u ** (2 - v)) / (U**2 - u**2)), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("rows", [11, 201])
def test_drag_that_grows_evenly_lags_by_the_response_however_few_the_rows(rows):
    a, t = arm(1), np.linspace(0, 2, rows)
    still = torch.zeros(rows, 1, dtype=torch.float64)
    flow = Flow(a, Motion(tensor(t), still, still, still, tensor(np.sqrt(0.3 * t)), still[:, 0]))
    change = made("flow_memory", a, share=(1.0,), response=(0.04,)).torque(flow)[1:, 0]
    drag = NormalDrag((1.0,)).torque(flow)[:, 0]
    grown = 0.04 * (1 - torch.exp(-tensor(t[1:]) / 0.04))
    assert_close(change, -(drag[-1] / 2) * grown, rtol=1e-7, atol=1e-9)


def test_the_wake_that_develops_is_over_after_its_reach():
    a, t = arm(1), np.linspace(0, 4, 401)
    still = torch.zeros(401, 1, dtype=torch.float64)
    flow = Flow(a, Motion(tensor(t), still, still, still, tensor(0.5 * t), torch.full((401,), 0.5, dtype=torch.float64)))
    X = made("wake_development", a, reach=(8.0,)).columns(flow)
    s = 0.25 * t**2 / 0.07
    assert not X[s > 8.0].any()
    early = (s > 0) & (s < 2)
    drag = NormalDrag((1.0,)).columns(flow)[..., 0]
    assert ((X[early, 0, :3].sum(-1) / drag[early, 0]) > 0.9).all()


def stopped(u0_after=0.0):
    """A one-link arm at rest behind a carriage that starts, stops at 2.2 s and then moves with `u0_after` m/s: flow and times."""
    a, t = arm(1), np.linspace(0, 4, 801)
    u0 = np.interp(t, [0, 0.5, 2.0, 2.2, 2.5, 4], [0, 0.6, 0.6, 0, u0_after, u0_after])
    still = torch.zeros(801, 1, dtype=torch.float64)
    return Flow(a, Motion(tensor(t), still, still, still, tensor(u0), still[:, 0])), t


def test_after_a_stop_the_wake_pushes_on_and_after_a_start_it_does_not():
    flow, t = stopped()
    slowing, meeting, push = made("wake_reentry", flow.arm, length=(5.0,), following=()).columns(flow)[:, 0].T
    for column in (slowing, meeting, push):
        assert not column[t < 1.9].any()
    assert (slowing[(t > 2.05) & (t < 2.15)] < 0).all(), "while it slows down its own wake carries it"
    assert (push[t > 2.25] < 0).all()
    assert not slowing[t > 2.25].any()
    assert not meeting.any(), "it never turns back"


@pytest.mark.parametrize(("u0_after", "back"), [(-0.4, True), (0.1, False)])
def test_all_of_the_wake_felt_the_drag_is_that_of_the_speed_through_moving_water(u0_after, back):
    flow, t = stopped(u0_after)
    effect = made("wake_reentry", flow.arm, length=(8.0,), fading=(0.5,), following=())
    columns = effect.columns(flow)[:, 0]
    w = Strips.of(flow, 10).w[:, 0, 0]
    m = overtaking(flow.motion.t, w[:, None, None], flow.D[:, None] * 8.0, 0.5)[:, 0, 0]
    o = torch.sign(m) * (m.abs() - (w * torch.sign(m)).clamp(min=0)).clamp(min=0)
    moment = 0.5 * flow.rho * flow.D[0] * flow.L[0] ** 2 / 2
    assert_close(columns.sum(1), moment * ((w - o).abs() * (w - o) - w.abs() * w))
    assert bool(columns[t > 2.5, 1].any()) == back


@pytest.mark.parametrize("u0_after", [-0.4, 0.1])
def test_to_first_order_a_wake_velocity_acts_as_Lambrakos_says_before_and_after_it_overtakes(u0_after):
    flow, _ = stopped(u0_after)
    columns = made("wake_reentry", flow.arm, length=(8.0,), fading=(0.5,), following=(0.2,)).columns(flow)[:, 0]
    w = Strips.of(flow, 10).w[:, 0, 0]
    m = overtaking(flow.motion.t, w[:, None, None], flow.D[:, None] * 8.0, 0.5)[:, 0, 0]
    moment = 0.5 * flow.rho * flow.D[0] * flow.L[0] ** 2 / 2
    assert_close(columns[:, [0, 1, 3]].sum(1), -2 * moment * w.abs() * m)
    assert bool((columns[100:380, 3] < 0).all()), "a link that goes on is carried, too"
    assert "While the link keeps moving" in made("wake_reentry", flow.arm, following=(0.2,)).statement()


def test_a_wake_that_fades_by_itself_is_forgotten_at_rest():
    t = tensor(np.linspace(0, 3, 301))
    w = torch.where(t < 1, 0.5, 0.0)[:, None, None].to(torch.float64)
    m = overtaking(t, w, torch.full((1, 1), 1e15, dtype=torch.float64), fading=2.0)[:, 0, 0]
    assert_close(m[t > 1.1], 0.5 * torch.exp(-2.0 * (t[t > 1.1] - 0.99)))
    assert float(overtaking(t, w, torch.full((1, 1), 1e15, dtype=torch.float64))[-1, 0, 0]) == pytest.approx(0.5)


def test_water_that_the_wake_drags_along_follows_it_with_a_lag_of_its_own():
    """Behind a step down to rest, both at rate r: v = e^(-r t),  s m' = r (v - m)  =>  m = (e^(-r t) - s e^(-r t/s)) / (1 - s)."""
    t = tensor(np.linspace(0, 4, 4001))
    w = torch.where(t < 1, 1.0, 0.0)[:, None, None].to(torch.float64)
    far, r, s = torch.full((1, 1), 1e15, dtype=torch.float64), 2.0, 0.5
    m = overtaking(t, w, far, r, s)[:, 0, 0]
    since = t[t > 1.1] - 0.999
    assert_close(m[t > 1.1], (torch.exp(-r * since) - s * torch.exp(-r * since / s)) / (1 - s), rtol=0.0, atol=2e-3)
    assert torch.equal(overtaking(t, w, far, r, 0.0), overtaking(t, w, far, r))
    close = overtaking(t, w, far, r, 1e-3)
    assert_close(close[t > 1.1], overtaking(t, w, far, r)[t > 1.1], rtol=0.01, atol=1e-9)


def test_the_water_that_is_met_passes_its_second_lag_on_and_old_models_have_none():
    flow, t = stopped(-0.4)
    at_once, late = (made("wake_reentry", flow.arm, length=(8.0,), second=(s,), following=()).columns(flow)[:, 0] for s in (0.0, 0.5))
    ratio = late.abs().sum(1) / at_once.abs().sum(1)
    assert (ratio[(t > 2.1) & (t < 2.2)] < 1).all(), "it has not caught up with the wake yet,"
    assert (ratio[t > 3.9] > 1).all(), "and runs on longer"
    parameters = {"slowing": [0.2], "meeting": [0.2], "push": [0.2], "length": [8.0], "fading": [0.0]}
    old = term_of({"kind": "effect:wake_reentry", "parameters": parameters, "options": {"joint": 0}})
    assert old == made("wake_reentry", flow.arm, length=(8.0,), fading=(0.0,), second=(), following=())
    assert torch.equal(old.columns(flow)[:, 0], at_once)
    assert "follows with 0.5 times this lag" in made("wake_reentry", flow.arm, second=(0.5,)).statement()
    assert "follows" not in old.statement()


def test_shedding_hums_at_twice_the_Strouhal_frequency():
    a, t = arm(1), np.linspace(0, 10, 4001)
    still = torch.zeros(4001, 1, dtype=torch.float64)
    flow = Flow(a, Motion(tensor(t), still, still, still, torch.full((4001,), 0.35, dtype=torch.float64), still[:, 0]))
    hum = made("vortex_shedding", a, strouhal=(0.2,)).columns(flow)[:-1, 0, 0]
    assert np.fft.rfftfreq(4000, 10 / 4000)[int(torch.fft.rfft(hum).abs().argmax())] == pytest.approx(2 * 0.2 * 0.35 / 0.07)


def test_wakes_of_several_laws_computed_together_are_those_of_each_alone():
    flow, _ = stopped(-0.4)
    laws = [made("wake_reentry", flow.arm, length=(length,), fading=(fading,), second=(second,))
            for length, fading, second in ((2.0, 0.0, 0.0), (8.0, 0.5, 0.5), (8.0, 0.5, 0.0), (31.7, 1.3, 0.0))]
    laws += [replace(laws[1], following=()), replace(laws[3], following=())]
    together = flow.again()
    type(laws[0]).prepare([together], laws)
    for law in laws:
        assert torch.equal(law.columns(together), law.columns(flow.again()))


@pytest.mark.parametrize(("name", "joint", "values"), [
    ("flow_memory", 0, [{"response": (0.03,)}, {"response": (0.03,), "velocity": (1.0,)}, {"response": (0.5,), "travel": (1.0,)}]),
    ("link_interference", 2, [{"power": (power,), "reach": (reach,)} for power in (0.5, 2.0) for reach in (3.0, 10.0)])])
def test_columns_of_several_laws_on_one_motion_are_those_of_each_alone(name, joint, values):
    """What they share is computed once."""
    flow = Flow(arm(2), run(2, 300))
    laws = [made(name, flow.arm, joint, **chosen) for chosen in values]
    together = flow.again()
    type(laws[0]).prepare([together], laws)
    for law in laws:
        assert torch.equal(law.columns(together), law.columns(flow.again()))
