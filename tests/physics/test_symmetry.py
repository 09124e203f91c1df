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
def test_the_motion_mirrored_along_the_tow_needs_the_opposite_torques(kind, links, make):
    a, motion = arm(links), make(links, seed=41)
    term = term_kinds()[kind].at_start(a)
    assert_close(torque(term, a, mirrored_about_Y(motion)), -torque(term, a, motion))


@KINDS
@LINKS
@MOTIONS
def test_the_motion_mirrored_across_the_tow_needs_the_opposite_torques(kind, links, make):
    a, motion = arm(links), make(links, seed=42)
    term = term_kinds()[kind].at_start(a)
    assert_close(torque(term, a, mirrored_about_X(motion)), -torque(term, a, motion))


@KINDS
@LINKS
@MOTIONS
def test_half_a_turn_of_the_whole_rig_changes_nothing(kind, links, make):
    a, motion = arm(links), make(links, seed=43)
    term = term_kinds()[kind].at_start(a)
    assert_close(torque(term, a, half_turned(motion)), torque(term, a, motion))
