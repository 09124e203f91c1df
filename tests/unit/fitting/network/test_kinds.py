"""Kinds of motion, and which physics a hybrid stands on."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import GIVEN, campaign, planted, recording
from rigs import arm

from nnhydro.fitting.network.base_choice import baseline_choice
from nnhydro.fitting.network.kinds import of_one_kind, progress, swing
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.splitting import units


def swinging(hz, name, rows=200):
    """A link that swings at `hz` for four seconds; 0: it turns on and on."""
    a = arm(1)
    r = recording(a, planted(a), name, seed=1, seconds=4.0, rate=rows / 4)
    t, w = r.t, 2 * np.pi * max(hz, 1e-9)
    q, qd, qdd = (0.4 * np.sin(w * t), 0.4 * w * np.cos(w * t), -0.4 * w**2 * np.sin(w * t)) if hz else (0.5 * t, 0.5 + 0 * t, 0 * t)
    return replace(r, q=q[:, None], qd=qd[:, None], qdd=qdd[:, None], u0=None, du0=None)


def tank():
    a = arm(1)
    return units(Campaign.of(a, [swinging(hz, f"r{i}") for i, hz in enumerate((2.0, 0.0, 0.5, 1.0))]), GIVEN)


def test_a_link_that_turns_on_gets_all_the_way_and_one_that_swings_hardly_anywhere():
    fast, on, slow, medium = (progress(unit, arm(1)) for unit in tank())
    assert on == pytest.approx(1.0, abs=0.02)
    assert slow == pytest.approx(2 * 0.4 / (4 * 0.4 * 0.5 * 4), rel=0.05)  # from end to end over the way of two swings
    assert fast < medium < slow < on


def test_what_swings_has_accelerations_as_its_keulegan_carpenter_number_says_and_what_turns_on_none():
    fast, on, slow, medium = (swing(unit, arm(1)) for unit in tank())
    assert on == pytest.approx(0.0, abs=1e-9)
    keulegan_carpenter = 2 * np.pi * 0.4 * arm(1).links[0].length_m / arm(1).links[0].diameter_m
    assert [slow, medium, fast] == pytest.approx([2 * np.pi / keulegan_carpenter * 4 / np.pi] * 3, rel=0.05), "of one amplitude"


def test_blocks_are_neighbours_in_kind_and_leave_something_to_fit():
    assert [of_one_kind(tank(), arm(1), 0.25, place) for place in (0.0, 1.0)] == [(0,), (1,)]
    assert of_one_kind(tank(), arm(1), 0.25, 0.0, swing) == (1,)
    assert of_one_kind(tank()[:1], arm(1), 0.25, 0.0) == ()


def test_the_plain_baseline_is_kept_where_no_other_is_clearly_better():
    a = arm(2)
    made = campaign(a, planted(a), 6, seconds=2.0, rate=25.0, noise=0.02)
    assert baseline_choice(units(made, GIVEN), a, GIVEN) == ("constant",)
    assert baseline_choice(units(made, GIVEN)[:2], a, GIVEN) == ("constant",), "too few to tell"
