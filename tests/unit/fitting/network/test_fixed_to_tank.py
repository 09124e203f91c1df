"""What is fixed to the tank is taken out of torques and targets, once and wholly; every member is judged by its own part."""

import numpy as np
import torch
from campaigns import GIVEN, campaign, planted
from rigs import arm, assert_close

from nnhydro.features.free_part import FreeRange, free_functions
from nnhydro.fitting.linear.several_arms import calibrated_on
from nnhydro.fitting.network.fixed_to_tank import on_base, targets_without, without
from nnhydro.fitting.network.linear_part import LinearPart
from nnhydro.fitting.network.rows import Rows, base_rows
from nnhydro.models.baselines import baseline
from nnhydro.models.learned.linear_parts import FreePart
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.splitting import units

MEMBERS, FUNCTIONS, ROWS = 3, 2, 12


def parts():
    """A linear part as members know it, and as it is used, of two columns of law and two free functions."""
    generator = torch.Generator().manual_seed(0)
    shared, none = torch.zeros(MEMBERS, 2).double(), torch.zeros(MEMBERS, 0, 2).double()
    return tuple(LinearPart(shared, none, torch.randn(MEMBERS, FUNCTIONS, 2, generator=generator).double()) for _ in range(2))


def rows(columns):
    """Rows of three units with a target of ones."""
    ones = torch.ones(len(columns), 2)
    return Rows(ones, torch.ones(2), ones, ones.clone(), torch.arange(len(columns)) % 3)


def test_a_recording_without_the_pull_has_the_torque_of_the_rest():
    a = arm(2)
    (unit, *_) = units(campaign(a, planted(a), 2, seconds=2.0, rate=25.0), GIVEN)
    (segment,) = unit.segments()
    flow = Flow(a, Motion.of(segment))
    seen = FreeRange.of(flow)
    count, generator = free_functions(flow, seen).shape[1], torch.Generator().manual_seed(1)
    fixed = FreePart(seen, torch.randn(MEMBERS, count, 2, generator=generator).double())
    (cleaned,) = without(unit, fixed, a).segments()
    np.testing.assert_allclose(cleaned.tau, segment.tau - fixed.torque(flow).mean(dim=0).numpy(), atol=1e-12)
    assert np.array_equal(cleaned.q, segment.q)


def test_targets_lose_the_mean_pull_and_each_member_is_judged_by_its_own():
    columns = torch.randn(ROWS, 2, 2 + FUNCTIONS, generator=torch.Generator().manual_seed(2))
    unseen, used = parts()
    found = targets_without(rows(columns), columns, unseen, used)
    assert_close(found.target.double(), 1 - used.free_torque(columns.double()).mean(dim=1), rtol=1e-5, atol=1e-5)
    mine = torch.zeros(MEMBERS, ROWS, dtype=torch.bool)
    mine[1] = True
    own = found.target_of(torch.arange(ROWS), mine)
    assert_close(own, 1 - unseen.free_torque(columns.double())[:, 1], rtol=1e-5, atol=1e-5)


def test_rows_on_another_baseline_hold_what_that_one_leaves():
    a = arm(2)
    chosen = units(campaign(a, planted(a), 3, seconds=2.0, rate=25.0), GIVEN)
    old, new = (calibrated_on(baseline(name), chosen, a, GIVEN) for name in ("textbook", "constant"))
    count = len(base_rows(chosen, a, old))
    before = rows(torch.zeros(count, 2, 1))
    after = on_base(before, old, new, chosen, a)
    assert_close(after.target + base_rows(chosen, a, new), before.target + base_rows(chosen, a, old), rtol=1e-5, atol=1e-5)
    assert on_base(before, None, None, chosen, a) is before
