"""Training of a strip net: that it learns, and the same each time."""

from dataclasses import fields, replace

import pytest
import torch
from campaigns import GIVEN, campaign, planted
from rigs import arm
from strip_nets import single

from nnhydro.errors import ModelError
from nnhydro.fitting.network.strip_net.fit import fit_strip_net, loads
from nnhydro.fitting.network.strip_net.rows import StripRun, Together, runs_of
from nnhydro.models.learned.strip_inputs import rigid_torque
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.recordings.repeats import group_names
from nnhydro.recordings.splitting import units


def chosen(seconds=2.5, count=6):
    a = arm(2)
    whole = campaign(a, state_loads(a), count, seconds=seconds, rate=40.0)
    return a, units(whole, GIVEN, 0, group_names(whole))


def test_a_net_learns_of_recordings_what_others_hold():
    a, every = chosen()
    net = fit_strip_net(runs_of(every[:5], a), seed=0)
    segment, = every[5].segments()
    flow = Flow(a, Motion.of(segment))
    left = tensor(segment.tau) - rigid_torque(flow)
    assert float((left - net.torque(flow)).abs().sum() / left.abs().sum()) < 0.35


def test_a_net_learns_that_links_of_unlike_shape_have_unlike_drag():
    a = arm(2)
    whole = campaign(a, planted(a, C_D=(0.5, 2.0)), 6, seconds=2.5, rate=40.0)
    every = units(whole, GIVEN, 0, group_names(whole))
    net = fit_strip_net(runs_of(every[:5], a), seed=0)
    segment, = every[5].segments()
    flow = Flow(a, Motion.of(segment))
    left = tensor(segment.tau) - rigid_torque(flow)
    placed, blind = (float((left - each.torque(flow)).abs().sum() / left.abs().sum()) for each in (net, replace(net, place=0 * net.place)))
    assert placed < 0.35
    assert blind > 1.2 * placed


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
    load = loads(single(net), Together.of([run]))
    want = net.torque(Flow(a, steady))
    assert float((run.torque(load, net.body.float()) - want).abs().max()) < 1e-4 * float(want.abs().max())


def test_a_short_steady_run_beside_a_longer_one_leaves_every_weight_finite():
    a, every = chosen(seconds=1.0, count=1)
    run, = runs_of(every, a)
    short = [getattr(run, field)[:8] for field in ("way", "levers", "columns", "left", "keep")]
    given = type(run.given)(*(getattr(run.given, field.name)[:8] for field in fields(run.given)))
    steady = StripRun(1, given, *short[:3], None, *short[3:], False, True, run.drift)
    net = fit_strip_net([run, steady], seed=0, epochs=2)
    assert all(bool(x.isfinite().all()) for x in net.arrays().values())


def test_a_training_that_diverges_is_told_with_what_to_do():
    a, every = chosen(seconds=1.0, count=2)
    runs = runs_of(every, a)
    broken = replace(runs[0], left=torch.full_like(runs[0].left, torch.inf))
    with pytest.raises(ModelError, match="strip_net = false"):
        fit_strip_net([broken, *runs[1:]], seed=0, epochs=2)
