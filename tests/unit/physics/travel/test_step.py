"""The travel of each strip, from one instant to the next, is that of the run as a whole."""

from dataclasses import replace

import pytest
import torch
from rigs import arm, assert_close, run

from nnhydro.physics.carried import StepMemory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.step import FOREVER, carried_travel
from nnhydro.physics.travel.travel import TravelRule, travel


def stepped(a, motion, rule):
    """The travel of all rows, stepped one by one."""
    memory, found = None, []
    for k in range(len(motion)):
        carried = StepMemory(motion.t[k:k + 1] - motion.t[max(k - 1, 0)], memory)
        found.append(carried_travel(Strips(Flow(a, replace(motion.rows(slice(k, k + 1)), carried=carried)), 3), rule, carried))
        memory = carried.after
    return torch.cat(found)


@pytest.mark.parametrize("rule", [TravelRule(), TravelRule("keep"), TravelRule("decay", 2.0), TravelRule(dwell_s=0.2)])
def test_stepped_through_time_the_travel_is_that_of_the_run(rule):
    a, motion = arm(2), run(2, 240)
    assert_close(stepped(a, motion, rule), travel(Strips(Flow(a, motion), 3), rule))


def test_a_strip_that_moves_at_the_first_instant_has_moved_for_ever():
    a, t = arm(1), torch.linspace(0, 1, 11, dtype=torch.float64)
    one = torch.ones(11, dtype=torch.float64)
    still = torch.zeros(11, 1, dtype=torch.float64)
    assert bool((stepped(a, Motion(t, still, still, still, one, 0 * one), TravelRule()) == FOREVER).all())
