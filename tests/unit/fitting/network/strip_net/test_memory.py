"""The memory of strips as it is trained: its states and gradient are those of the net's own steps."""

from dataclasses import fields, replace

import torch
from campaigns import GIVEN, planted, recording
from rigs import arm
from strip_nets import net

from nnhydro.fitting.network.strip_net.fit import loads
from nnhydro.fitting.network.strip_net.rows import Together, runs_of
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.repeats import group_names
from nnhydro.recordings.splitting import units


def rows_of(a):
    """Rows of four runs of unlike length, one under tow from the start and one in steady flow, in double precision."""
    whole = Campaign.of(a, [recording(a, planted(a), f"run{i}", seed=i + 1, seconds=seconds, rate=20.0, speed=speed)
                            for i, (seconds, speed) in enumerate(((1.0, 0.0), (1.5, 0.3), (0.7, 0.0)))])
    every = runs_of(units(whole, GIVEN, 0, group_names(whole)), a)
    rows = Together.of([*every, replace(every[0], steady=True)])
    given = (getattr(rows.given, field.name).double() for field in fields(rows.given))
    return replace(rows, given=type(rows.given)(*given), way=rows.way.double())


def test_the_gradient_is_that_of_small_differences():
    a = arm(2)
    rows, water = rows_of(a), net(a)
    names = ("inner", "drive", "gate", "gate_bias", "theta", "kappa")

    def load(*tensors):
        return (weight * loads(replace(water, **dict(zip(names, tensors, strict=True))), rows)).sum()

    weight = torch.randn(len(rows.place), 8, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    assert torch.autograd.gradcheck(load, [getattr(water, name).clone().requires_grad_(True) for name in names], atol=1e-4, rtol=1e-4)
