"""Rows of models over the travel, faster than column by column, are the same rows."""

import numpy as np
import pytest
import torch
from campaigns import recording, sensor_torque
from rigs import arm

from nnhydro.fitting.travel.state_rows import general, rows_of
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.recordings.filtering.preprocessing import Preparation, prepare


@pytest.mark.parametrize("links", [1, 2])
def test_the_fast_rows_are_the_general_ones_for_one_and_for_two_scales(links):
    a = arm(links)
    loads = state_loads(a, per_link=3)
    free = Loads({name: term for name, term in loads.terms.items() if name != "rigid_body"})
    pairs = []
    for seed in (1, 2):
        r = recording(a, loads, seed=seed, seconds=1.0, rate=50.0)
        segment = next(iter(prepare(r, Preparation(None))))
        motion = Motion.of(segment)
        pairs.append((Flow(a, motion), torch.from_numpy(sensor_torque(a, loads, motion))))
    fast, slow = rows_of(free, pairs), general(free, pairs)
    for nu in ((3.0,), (4.0, 4.0), (3.0, 8.0)):
        for one, other in zip(fast(nu), slow(nu), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)
