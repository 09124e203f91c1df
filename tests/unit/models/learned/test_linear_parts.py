"""The linear parts as they were learned."""

from dataclasses import replace

import pytest
import torch
from rigs import arm, at_rest, mirrored_about_Y, run, states
from untrained import random_law

from nnhydro.features.body_columns import body_columns
from nnhydro.features.free_part import FreeRange, free_functions
from nnhydro.features.strip_law.law import law_torque
from nnhydro.features.strip_law.state import StripView, state_sets, strip_states
from nnhydro.models.learned.linear_parts import FreePart
from nnhydro.physics.flow import Flow


@pytest.mark.parametrize("name", state_sets())
@pytest.mark.parametrize("links", [1, 2, 3])
def test_the_mirror_is_exact_for_every_law_of_the_strips(name, links):
    a = arm(links)
    for motion in (states(links), run(links)):
        law = random_law(a, motion, (name,))
        one, other = law.torque(Flow(a, motion)), law.torque(Flow(a, mirrored_about_Y(motion)))
        scale = float(one.abs().max())
        torch.testing.assert_close(other / scale, -one / scale, rtol=0.0, atol=1e-11)
    assert not law.torque(Flow(a, at_rest(links))).any()


def test_a_law_whose_variables_leave_the_range_of_training_stays_what_it_was_at_the_edge():
    a, slow = arm(2), run(2)
    law = random_law(a, slow, ("reynolds",))
    flow = Flow(a, replace(slow, qd=3 * slow.qd, qdd=9 * slow.qdd, u0=3 * slow.u0, du0=9 * slow.du0))
    z, of_three = strip_states(StripView(flow), ("reynolds",))
    assert bool((z > law.highest[:, None]).any()), "there are faster strips than before"
    edge = torch.minimum(torch.maximum(z, law.lowest[:, None]), law.highest[:, None])
    body = torch.einsum("njp,ep->enj", body_columns(flow), law.body)
    torch.testing.assert_close(law.torque(flow) - body, law_torque(StripView(flow), edge, of_three, law.coefficients, law.neurons))


def test_a_free_part_is_the_same_after_its_arrays():
    a, motion = arm(2), run(2)
    seen = FreeRange.of(Flow(a, motion))
    functions = free_functions(Flow(a, motion), seen).shape[1]
    part = FreePart(seen, torch.randn(3, functions, 2, generator=torch.Generator().manual_seed(1), dtype=torch.float64))
    again = FreePart.of_arrays(part.arrays())
    assert part.torque(Flow(a, motion)).shape == (3, 60, 2)
    assert torch.equal(again.torque(Flow(a, motion)), part.torque(Flow(a, motion)))
    twice = replace(part, coefficients=2 * part.coefficients)
    torch.testing.assert_close(twice.torque(Flow(a, motion)), 2 * part.torque(Flow(a, motion)))
