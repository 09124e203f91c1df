"""The strip net: odd in the mirror, bounded whatever it is fed with, the same in steps as in a run."""

from dataclasses import replace

import pytest
import torch
from campaigns import DEFAULT_LAWS, campaign, planted
from rigs import arm, mirrored_about_X, mirrored_about_Y, run
from strip_nets import SIZE, net, remembering

from nnhydro.deployment.onnx.tracing import trace
from nnhydro.fitting.network.train import train
from nnhydro.models.learned import strip_net
from nnhydro.models.learned.learned import view_of
from nnhydro.models.learned.strip_inputs import StripInputs, rigid_torque
from nnhydro.physics.carried import StepMemory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion

NETWORK = DEFAULT_LAWS.model_copy(update={"model": "network", "epochs": 1})


def in_steps(model, a, m):
    found, before = [], None
    for k in range(len(m)):
        rows = slice(k, k + 1)
        dt = m.t[rows] - m.t[k - 1] if k else torch.zeros(1, dtype=torch.float64)
        carried = StepMemory(dt, before)
        now = Motion(m.t[rows], m.q[rows], m.qd[rows], m.qdd[rows], m.u0[rows], m.du0[rows], True, None, carried)
        found.append(model.torque(Flow(a, now)))
        before = carried.after
    return torch.cat(found)


@pytest.mark.parametrize("mirror", [mirrored_about_X, mirrored_about_Y])
def test_torques_turn_with_the_mirror(mirror):
    a, m = arm(2), run(2)
    torque, mirrored = (net(a).torque(Flow(a, motion)) for motion in (m, mirror(m)))
    sign = 1 if torch.allclose(mirror(m).q, m.q) else -1
    assert torque.abs().max() > 1
    assert torch.allclose(mirrored, sign * torque, rtol=0, atol=1e-11 * float(torque.abs().max()))


def test_a_network_that_uses_all_of_a_net_is_the_net_and_the_rigid_links_however_unfamiliar_the_motion():
    network, m = remembering(train(campaign(arm(2), planted(arm(2)), 3, seconds=1.0, rate=50.0), NETWORK)), run(2)
    whole = replace(network, share=torch.ones(2, dtype=torch.float64), water=replace(network.water, drift=network.water.drift + 1e6))
    flow = Flow(whole.arm, m)
    assert float(whole.familiarity(whole.standardised_features(view_of(whole.arm, m, whole.floor))).min()) < 0.9
    torch.testing.assert_close(whole.torque(m), rigid_torque(flow) + whole.water.torque(flow), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("links", [1, 2, 3])
def test_steps_give_what_the_run_gives(links):
    a, m = arm(links), run(links)
    whole = net(a).torque(Flow(a, m))
    assert torch.allclose(in_steps(net(a), a, m), whole, rtol=0, atol=1e-11 * float(whole.abs().max()))


@pytest.mark.parametrize("first", [0, 5], ids=["from rest", "under way"])
@pytest.mark.parametrize("rows", [1, 7])
def test_a_long_run_in_parts_gives_what_it_gives_as_a_whole(rows, first, monkeypatch):
    a, m = arm(2), run(2).rows(slice(first, None))
    assert len(m) < strip_net.ROWS
    whole = net(a).torque(Flow(a, m))
    monkeypatch.setattr(strip_net, "ROWS", rows)
    assert torch.allclose(net(a).torque(Flow(a, m)), whole, rtol=0, atol=1e-11 * float(whole.abs().max()))


def test_a_step_fades_and_turns_the_state_and_adds_what_drives_it_at_half_the_turn():
    """h <- K T^2 h + (1 - K) T d with K = exp(-rate dsigma), T = exp(i (theta dsigma, kappa ds)/2), in complex numbers."""
    water, k = net(arm(2)), SIZE // 2
    rate, d, place = torch.rand(2 * k).double(), torch.complex(*torch.randn(2, k).double()), torch.randn(k).double()
    dsigma, ds = 0.7, -0.4
    middle = torch.cat([rate, d.real, d.imag, place])[None, None]
    keep_re, keep_im, re, im = water.increments(middle, torch.tensor([[[dsigma, ds]]], dtype=torch.float64))
    turn = torch.exp(0.5j * torch.cat([water.theta * dsigma, water.kappa * ds]))
    keep, driven = torch.exp(-rate * dsigma), torch.cat([d, place.to(d.dtype)])
    assert torch.allclose(torch.complex(keep_re, keep_im)[0, 0], keep * turn**2)
    assert torch.allclose(torch.complex(re, im)[0, 0], (1 - keep) * turn * driven)


def test_states_are_bounded_by_what_drives_them_however_large_the_weights():
    a, m = arm(2), run(2)
    wild = replace(net(a), **{name: 50 * getattr(net(a), name) for name in ("inner", "gate", "theta", "kappa")})
    flow = Flow(a, replace(m, t=20 * m.t))
    z = StripInputs.of(flow)
    _, both, _ = wild.encode(z)
    re, im = wild.states(flow, z, both)
    drive = both[..., SIZE:]
    assert torch.hypot(re, im).max() <= 2**0.5 * drive.abs().max() * (1 + 1e-9)


def test_a_flow_that_has_lasted_has_the_states_that_a_long_steady_run_reaches():
    a, still, n = arm(2), torch.zeros(4000, 2, dtype=torch.float64), 4000
    speed = torch.full((n,), 0.5, dtype=torch.float64)
    q = torch.full((n, 2), 0.3, dtype=torch.float64)
    towed = Motion(torch.arange(n, dtype=torch.float64) * 0.01, q, still, still, speed, 0 * speed)
    flow = Flow(a, towed)
    z = StripInputs.of(flow)
    model = net(a)
    _, both, _ = model.encode(z)
    long, lasting = torch.cat(model.states(flow, z, both), dim=2), torch.cat(model.lasting(both, z.speeds), dim=2)
    assert torch.allclose(long[-1], lasting[-1], atol=0.05 * float(lasting.abs().max()))


def test_a_step_can_be_traced():
    a = arm(2)
    model, zero = net(a), torch.zeros(1, dtype=torch.float64)
    shapes = StepMemory(zero)

    def instant(q, qd, qdd, dt, carried):
        return Motion(zero, q, qd, qdd, zero, zero, True, None, carried)

    q = torch.full((1, 2), 0.4, dtype=torch.float64)
    model.torque(Flow(a, instant(q, q, q, zero, shapes)))
    names, before = list(shapes.after), [x + 0.1 for x in shapes.after.values()]

    def step(q, qd, qdd, dt, *memory):
        carried = StepMemory(dt, dict(zip(names, memory, strict=True)))
        return model.torque(Flow(a, instant(q, qd, qdd, dt, carried))), *carried.after.values()

    given = [q, 2 * q, 3 * q, zero + 0.01, *before]
    program, outputs = trace(step, given)
    flat = [x for array in outputs for x in array.ravel()]
    got = program.evaluate(flat, torch.cat([x.ravel() for x in given])[None].numpy())[0]
    want = torch.cat([x.ravel() for x in step(*given)]).numpy()
    assert abs(got - want).max() < 1e-9 * abs(want).max()


def test_a_net_that_never_saw_a_tow_is_not_used_under_tow():
    a, q = arm(2), torch.full((4, 2), 0.3, dtype=torch.float64)
    speed = torch.tensor([0.0, 0.5, 0.51, 1.0], dtype=torch.float64)
    flow = Flow(a, Motion.at(q, q, q, speed))
    never, slower = (replace(net(a), drift=torch.tensor([fastest**2], dtype=torch.float64)) for fastest in (0.0, 0.5))
    assert never.validity(flow)[0] == 1.0
    assert never.validity(flow)[1:].max() < 1e-6
    assert (slower.validity(flow)[:2] == 1.0).all()
    assert slower.validity(flow)[2] > 0.9
    assert slower.validity(flow)[3] < 0.05


def test_the_torque_has_a_slope_at_rest():
    a, zero = arm(2), torch.zeros(1, dtype=torch.float64)
    still = torch.zeros(1, 2, dtype=torch.float64, requires_grad=True)
    net(a).torque(Flow(a, Motion(zero, still, still, still, zero, zero, True, None, StepMemory(zero)))).sum().backward()
    assert bool(still.grad.isfinite().all())
