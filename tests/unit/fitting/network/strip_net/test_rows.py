"""Stretches of recordings for a strip net: cut, filtered and begun as the whole recording is."""

import numpy as np
import pytest
import torch
from campaigns import GIVEN, campaign, planted, recording
from rigs import arm
from strip_nets import net, single

from nnhydro.fitting.network.strip_net.fit import loads
from nnhydro.fitting.network.strip_net.rows import ROWS, ROWS_PER_CUTOFF, WARM, Together, runs_of
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.repeats import group_names
from nnhydro.recordings.splitting import units

SINGLE = 1e-4  # of the largest torque: float32


def all_of(whole):
    return units(whole, GIVEN, 0, group_names(whole))


def close(got, want):
    assert float((got - want).abs().max()) < SINGLE * float(want.abs().max())


def each_of(model, runs):
    """The loads of each run, trained side by side."""
    return torch.split(loads(single(model), Together.of(runs)), [len(run.keep) for run in runs])


def deployed(a, unit):
    segment, = unit.segments()
    return net(a).torque(Flow(a, Motion.of(segment)))


@pytest.mark.parametrize("speed", [0.0, 0.4])
def test_side_by_side_the_strips_give_what_the_deployed_net_gives_of_each_run_alone(speed):
    a = arm(2)
    whole = Campaign.of(a, [recording(a, planted(a), f"run{i}", seed=i + 1, seconds=seconds, rate=50.0, speed=speed)
                            for i, seconds in enumerate((2.0, 3.5))])
    chosen = all_of(whole)
    runs, model = runs_of(chosen, a), net(a)
    assert len({len(run.keep) for run in runs}) == 2
    for run, load, unit in zip(runs, each_of(model, runs), chosen, strict=True):
        close(run.torque(load, model.body.float()), deployed(a, unit))


def test_of_a_long_recording_each_stretch_gives_nearly_what_the_whole_gives_in_its_place():
    a = arm(2)
    whole = campaign(a, planted(a), 1, seconds=50.0, rate=100.0)
    (unit,), model = all_of(whole), net(a)
    runs = runs_of([unit], a)
    stride = -(-5000 // ROWS)
    assert len(runs) == 1, "what is not filtered is thinned out to one stretch"
    filtered = units(whole, whole.plan(4.0), 0, group_names(whole))
    runs = runs_of(filtered, a)
    assert len(runs) > 1
    assert [bool(run.moves) for run in runs] == [False] + [True] * (len(runs) - 1)
    assert all(not bool(run.keep[:WARM].any()) for run in runs[1:])
    kept = sum(int(run.keep.sum()) for run in runs)
    segment, = filtered[0].segments()
    stride = int(1 / (ROWS_PER_CUTOFF * 4.0 * segment.dt))
    assert kept == int(segment.keep[::stride].sum()), "every row is compared once"
    tau = segment.filter((model.torque(Flow(a, Motion.of(segment)))).numpy())[::stride]
    for number, (run, load) in enumerate(zip(runs, each_of(model, runs), strict=True)):
        start = max(0, number * ROWS - WARM)
        off = np.abs((run.torque(load, model.body.float())).numpy() - tau[start:start + len(run.keep)])[run.keep.numpy()]
        assert np.median(off) < 0.1 * np.abs(tau).max()


def test_what_the_rigid_body_leaves_is_the_target():
    a = arm(2)
    unit, = all_of(campaign(a, planted(a), 1, seconds=2.0, rate=50.0))
    run, = runs_of([unit], a)
    segment, = unit.segments()
    water = torch.stack([term.torque(Flow(a, Motion.of(segment))) for name, term in planted(a).terms.items() if name != "rigid_body"])
    close(run.left, water.sum(dim=0).float())
