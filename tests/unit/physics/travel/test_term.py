"""What terms over the travel share: columns of a strip sum, and how many ordinates there may be."""

import pytest
import torch
from rigs import arm, assert_close, run

from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.state_model import (
    state_loads,
)
from nnhydro.physics.travel.term import strip_columns, unit_drag


def test_a_number_of_ordinates_that_fits_no_arm_is_refused():
    loads = state_loads(arm(3), curve_per_link=True)
    with pytest.raises(ModelError, match="give 1, or 2, one per link"):
        loads.terms["state_drag"].torque(Flow(arm(2), run(2)))


def test_columns_of_a_strip_sum_match_a_sum_by_hand():
    flow = Flow(arm(2), run(2))
    strips = Strips.of(flow, 7)
    phi = torch.stack([torch.ones_like(strips.w), strips.x.expand_as(strips.w)], dim=-1)
    columns = strip_columns(strips, unit_drag(strips), phi)
    for k in range(2):
        assert_close(columns[..., k], strips.to_joints(unit_drag(strips) * phi[..., k]))
