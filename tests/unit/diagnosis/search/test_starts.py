"""Waves are tried at the lines of the torque, and across links that are held."""

import numpy as np
import pytest
from diagnosed import campaign
from rigs import arm

from nnhydro.diagnosis.problem.design import design_on
from nnhydro.diagnosis.problem.hypothesis import enumerate_hypotheses
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.search.starts import across_held_links, at_lines, line_frequencies


def test_the_line_of_a_wave_is_found_in_what_the_baseline_leaves():
    design = design_on(problem_of(campaign("held in a wave")), None)
    assert min(abs(f - 0.965) for f in line_frequencies(design)) < 0.005
    assert across_held_links(design) == (), "it is held at another angle in every recording"


def test_across_a_link_that_is_held_is_a_right_angle_from_it():
    from dataclasses import replace

    from nnhydro.recordings.campaign import Campaign

    of = campaign("held in a wave")
    still = [replace(r, q=0 * r.q + 0.4) for r in of.recordings()]
    (direction,) = across_held_links(design_on(problem_of(Campaign.of(of.arm, still)), None))
    assert direction == pytest.approx(0.4 + np.pi / 2)


def test_a_wave_is_tried_at_every_line_from_every_side_and_what_has_no_frequency_is_not():
    laws = enumerate_hypotheses(arm(1), (3.0,))
    sides = {h.effect.direction for h in laws if h.key[0] == "wave_orbital"}
    made = at_lines(laws, (0.7, 1.1), (0.123,))
    assert {h.key[0] for h in made} == {"wave_orbital"}
    assert {(h.effect.frequency[0], h.effect.direction) for h in made} == {(f, d) for f in (0.7, 1.1) for d in sides | {(0.123,)}}
    assert all(h.spans["frequency"][0] < h.effect.frequency[0] < h.spans["frequency"][1] for h in made)
