"""What the mirror need not repeat: smooth, bounded, silent outside the range it was learned on, there only where it is asked for."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import DEFAULT_LAWS, GIVEN, campaign, planted, with_torque
from rigs import arm, assert_close, mirrored_about_Y, run, states

from nnhydro.features.free_part import FreeRange, free_functions
from nnhydro.fitting.network.train import train
from nnhydro.models.learned.linear_parts import FreePart
from nnhydro.models.storage import load_model, save_model
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion

FAST = DEFAULT_LAWS.model_copy(update={"members": 4, "epochs": 2, "validation_share": 0.25})


def slack(count=8):
    """An arm whose first joint a line pulls back beyond a third of a radian on one side alone."""
    a = arm(2)
    clean = campaign(a, planted(a), count, seconds=3.0, rate=25.0, noise=0.01)

    def pulled(name, tau):
        q = clean.load(name).q[:, 0]
        return tau - np.column_stack([4.0 * np.maximum(q - 0.3, 0.0), np.zeros_like(q)])

    return with_torque(clean, pulled)


def test_functions_are_bounded_and_held_outside_the_range():
    flow = Flow(arm(2), run(2))
    seen = FreeRange.of(flow)
    f = free_functions(flow, seen)
    assert float(f.abs().max()) <= 1.0
    far = replace(flow.motion, q=flow.motion.q + 100.0)
    edge = replace(flow.motion, q=seen.highest.expand_as(flow.motion.q))
    assert_close(free_functions(Flow(arm(2), far), seen), free_functions(Flow(arm(2), edge), seen))


def test_the_range_of_two_motions_holds_both():
    one, other = (FreeRange.of(Flow(arm(2), motion)) for motion in (run(2), states(2)))
    both = one.and_of(other)
    assert bool((both.lowest <= torch.minimum(one.lowest, other.lowest)).all())
    assert bool((both.highest >= torch.maximum(one.highest, other.highest)).all())
    assert bool((both.fastest >= torch.maximum(one.fastest, other.fastest)).all())


@pytest.mark.slow
def test_a_slack_line_is_learned_by_the_free_part_and_not_without_it():
    whole = slack()
    free, mirrored = (train(whole, FAST.model_copy(update={"free": asked})) for asked in (True, False))
    assert free.free is not None
    assert mirrored.free is None
    motion = Motion.of(whole.segments("run1", GIVEN)[0])
    tau = torch.tensor(whole.segments("run1", GIVEN)[0].tau)
    left = [float((tau - model.torque(motion)).abs().mean()) for model in (free, mirrored)]
    assert left[0] < 0.6 * left[1]


@pytest.mark.slow
def test_where_nothing_asks_for_it_there_is_none_and_the_mirror_is_exact():
    a = arm(2)
    model = train(campaign(a, planted(a), 6, seconds=2.0, rate=25.0, noise=0.01), FAST)
    assert model.free is None
    motion = run(2)
    assert_close(model.torque(mirrored_about_Y(motion)), -model.torque(motion), rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_a_model_with_a_free_part_is_stored_whole(tmp_path):
    a = arm(2)
    bare = train(campaign(a, planted(a), 4, seconds=2.0, rate=25.0, noise=0.01), FAST)
    seen = FreeRange.of(Flow(a, run(2)))
    count = free_functions(Flow(a, run(2)), seen).shape[1]
    c = torch.randn(FAST.members, count, 2, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    bare = replace(bare, trust=None)
    model = replace(bare, free=FreePart(seen, c))
    again = load_model(save_model(model, tmp_path / "m"))
    pull = FreePart(seen, c).torque(Flow(a, run(2))).mean(dim=0)
    assert_close(model.torque(run(2)), bare.torque(run(2)) + pull, rtol=1e-9, atol=1e-9)  # whole: neither bounded nor shrunk
    assert_close(again.torque(run(2)), model.torque(run(2)), rtol=1e-12, atol=1e-12)
    assert not torch.allclose(model.torque(run(2)), bare.torque(run(2)))
