"""Mirrors and turns of the rig: a load that breaks one of them has a wrong sign or a wrong index.

Every term declared in physics/loads is held to this; the plane is horizontal, so weight cannot tell left from right.
"""

import pytest
from rigs import arm, assert_close, half_turned, mirrored_about_X, mirrored_about_Y, run, states, torque

from nnhydro.physics.load_term import term_kinds

KINDS = pytest.mark.parametrize("kind", term_kinds())
LINKS = pytest.mark.parametrize("links", [1, 2, 3])
MOTIONS = pytest.mark.parametrize("make", [states, run])


@KINDS
@LINKS
@MOTIONS
@pytest.mark.parametrize(("moved", "sign"), [(mirrored_about_Y, -1), (mirrored_about_X, -1), (half_turned, 1)])
def test_a_mirrored_motion_needs_the_opposite_torques_and_half_a_turn_of_the_rig_changes_nothing(kind, links, make, moved, sign):
    a, motion = arm(links), make(links, seed=41)
    term = term_kinds()[kind].at_start(a)
    assert_close(torque(term, a, moved(motion)), sign * torque(term, a, motion))
