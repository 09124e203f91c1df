"""Named sets of strip variables: even in the mirror, bounded, side by side."""

import pytest
import torch
from rigs import arm, assert_close, mirrored_about_Y, run

from nnhydro.errors import ConfigError
from nnhydro.features.strip_law.state import StripView, known_states, sets_of, state_sets, strip_states
from nnhydro.physics.flow import Flow


@pytest.mark.parametrize("name", state_sets())
def test_a_set_is_even_in_the_mirror_and_bounded(name):
    a, motion = arm(3), run(3)
    here, there = (strip_states(StripView(Flow(a, m)), [name])[0] for m in (motion, mirrored_about_Y(motion)))
    assert here.shape[:2] == (60, 3)
    assert_close(there, here, 1e-9, 1e-9)
    assert float(here.abs().max()) < 10


def test_sets_stand_side_by_side_and_know_their_degree():
    view = StripView(Flow(arm(2), run(2)))
    names = ["reynolds", "memory", "bend"]
    z, of_three = strip_states(view, names)
    assert sets_of(view, names) == [0, 1, 1, 1, 1, 2]
    assert z.shape[2] == 6
    assert of_three == (1, 2, 3, 4)
    assert torch.equal(z[:, :, :1], strip_states(view, ["reynolds"])[0])


def test_no_set_has_no_variables():
    z, of_three = strip_states(StripView(Flow(arm(2), run(2))), [])
    assert z.shape[2] == 0
    assert of_three == ()


def test_an_unknown_set_is_refused():
    with pytest.raises(ConfigError, match="set of strip variables 'reynold'"):
        known_states(["reynold"])
