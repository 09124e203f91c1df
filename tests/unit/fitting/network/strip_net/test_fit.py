"""Training of a strip net: its gradient, and that it learns."""

from dataclasses import replace

import torch
from campaigns import GIVEN, campaign
from rigs import arm
from strip_nets import single

from nnhydro.fitting.network.strip_net.fit import _Scan, fit_strip_net, loads
from nnhydro.fitting.network.strip_net.rows import runs_of
from nnhydro.models.learned.strip_inputs import rigid_torque
from nnhydro.models.learned.strip_net import real_and_imaginary, recurrence
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.recordings.repeats import group_names
from nnhydro.recordings.splitting import units


def chosen(seconds=2.5, count=6):
    a = arm(2)
    whole = campaign(a, state_loads(a), count, seconds=seconds, rate=40.0)
    return a, units(whole, GIVEN, 0, group_names(whole))


def test_the_recurrence_and_its_gradient_are_those_of_the_plain_loop():
    generator = torch.Generator().manual_seed(0)
    given = [0.6 * torch.randn(7, 2, 3, generator=generator, dtype=torch.float64) for _ in range(4)]

    def loop(keep_re, keep_im, re, im):
        h = [torch.complex(re[0], im[0])]
        for t in range(1, len(re)):
            h.append(torch.complex(keep_re[t], keep_im[t]) * h[-1] + torch.complex(re[t], im[t]))
        return torch.stack(h).real, torch.stack(h).imag

    weight = torch.randn(2, 7, 2, 3, generator=generator, dtype=torch.float64)
    slopes = []
    for along in (loop, _Scan.apply):
        x = [z.clone().requires_grad_(True) for z in given]
        (weight * torch.stack(along(*x))).sum().backward()
        slopes.append([z.grad for z in x])
    for got, want in zip(slopes[1], slopes[0], strict=True):
        torch.testing.assert_close(got[1:], want[1:])
    for got, want in zip(real_and_imaginary(recurrence(*given)[1]), loop(*given), strict=True):
        torch.testing.assert_close(got, want)


def test_a_net_learns_of_recordings_what_others_hold():
    a, every = chosen()
    net = fit_strip_net(runs_of(every[:5], a), seed=0)
    segment, = every[5].segments()
    flow = Flow(a, Motion.of(segment))
    left = tensor(segment.tau) - rigid_torque(flow)
    assert float((left - net.torque(flow)).abs().sum() / left.abs().sum()) < 0.35


def test_the_same_seed_gives_the_same_net_whatever_was_drawn_before():
    a, every = chosen(seconds=1.0, count=2)
    runs = runs_of(every, a)
    first = fit_strip_net(runs, seed=3, epochs=2)
    torch.rand(5)
    again, other = fit_strip_net(runs, seed=3, epochs=2), fit_strip_net(runs, seed=4, epochs=2)
    assert all(torch.equal(x, again.arrays()[name]) for name, x in first.arrays().items())
    assert not torch.equal(first.inner, other.inner)


def test_a_steady_run_has_the_states_of_a_flow_that_has_lasted():
    a, every = chosen(seconds=1.0, count=1)
    run, = runs_of(every, a)
    net = fit_strip_net([run], seed=0, epochs=2)
    segment, = every[0].segments()
    steady = replace(Motion.of(segment), steady=True)
    run, = runs_of([replace(every[0], segments=lambda: (replace(segment, steady=True),))], a)
    load, = loads(single(net), [run])
    want = net.torque(Flow(a, steady))
    assert float((run.torque(load, net.body.float()) - want).abs().max()) < 1e-4 * float(want.abs().max())
