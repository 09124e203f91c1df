"""Waves are tried at the lines of the torque, of each recording's own where they differ, and across links that are held."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import OTHER_WAVES, campaign, diagnosed
from problems import design as rows
from problems import law
from problems import search as rig_search
from rigs import arm

from nnhydro.diagnosis.model.unknown import unknown_of
from nnhydro.diagnosis.noise.spectrum import calibrated_noise
from nnhydro.diagnosis.problem.hypothesis import enumerate_hypotheses
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.wave_frequencies import (
    across_fixed_links,
    at_lines,
    at_lines_per_recording,
    line_frequencies,
    lines_at_peak,
    lines_per_recording,
)
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary


def test_the_line_of_a_wave_is_found_in_what_the_baseline_leaves():
    design = design_on(problem_of(campaign("held in a wave")), None)
    assert min(abs(f - 0.965) for f in line_frequencies(design)) < 0.005
    assert across_fixed_links(design) == (), "it is held at another angle in every recording"


def test_across_a_link_that_is_held_is_a_right_angle_from_it():
    from nnhydro.recordings.campaign import Campaign

    of = campaign("held in a wave")
    still = [replace(r, q=0 * r.q + 0.4) for r in of.recordings()]
    (direction,) = across_fixed_links(design_on(problem_of(Campaign.of(of.arm, still)), None))
    assert direction == pytest.approx(0.4 + np.pi / 2)


def test_a_wave_is_tried_at_every_line_from_every_side_and_what_has_no_frequency_is_not():
    laws = enumerate_hypotheses(arm(1), (3.0,))
    sides = {h.effect.direction for h in laws if h.key[0] == "wave_orbital"}
    made = at_lines(laws, (0.7, 1.1), (0.123,))
    assert {h.key[0] for h in made} == {"wave_orbital"}
    assert {(h.effect.frequency[0], h.effect.direction) for h in made} == {(f, d) for f in (0.7, 1.1) for d in sides | {(0.123,)}}
    assert all(h.spans["frequency"][0] < h.effect.frequency[0] < h.spans["frequency"][1] for h in made)


def test_where_the_waves_differ_each_recording_has_its_line():
    design = design_on(problem_of(campaign("held in other waves")), None)
    found = lines_per_recording(design)
    assert [found[g] for g in range(6)] == pytest.approx(OTHER_WAVES, abs=0.005)
    assert lines_per_recording(design_on(problem_of(campaign("held in a wave")), None)) == {}, "one line in all"


def test_a_line_at_which_each_recording_moves_is_no_wave_of_its_own():
    """A section that is driven to and fro at another frequency in every recording, by a torque of that frequency that no baseline has."""
    from nnhydro.recordings.campaign import Campaign

    of = campaign("held in other waves")
    driven = []
    for recording, f in zip(of.recordings(), OTHER_WAVES, strict=True):
        w, t = 2 * np.pi * f, recording.t[:, None]
        driven.append(replace(recording, q=recording.q + 0.3 * np.sin(w * t), qd=0.3 * w * np.cos(w * t), qdd=-0.3 * w**2 * np.sin(w * t)))
    assert lines_per_recording(design_on(problem_of(Campaign.of(of.arm, driven)), None)) == {}


def test_the_law_of_lines_of_their_own_pays_for_every_line_it_could_have_had():
    design = design_on(problem_of(campaign("held in other waves")), None)
    made = at_lines_per_recording(enumerate_hypotheses(arm(1), (3.0,)), design)
    assert {h.key[0] for h in made} == {"wave_orbital"}
    assert all("frequency" not in h.spans and h.log_tried > 6 * np.log(10) for h in made), "20 s and more than 0.5 Hz, six times"
    assert [made[0].effect_in(g).frequency[0] for g in range(6)] == [made[0].lines[g] for g in range(6)]


@pytest.mark.slow
def test_waves_that_differ_are_told_with_the_frequency_of_each_recording():
    (finding,) = diagnosed("held in other waves").findings
    told = finding.parameters["frequency"]
    assert finding.effect == "wave_orbital"
    assert "0.53 to 1.22 Hz, another in each recording," in finding.statement
    assert told.by_recording == pytest.approx({f"held{k}": f for k, f in enumerate(OTHER_WAVES)}, abs=5e-4)
    assert diagnosed("held in other waves").heldout.after < 0.1


def test_a_line_that_is_a_third_of_the_resolution_off_is_moved_to_its_peak():
    """20 s: a resolution of 0.05 Hz."""
    design = design_on(problem_of(campaign("held in other waves")), None)
    _, whitened, sizes, model = calibrated_noise(design, unknown_of(design, design.baseline.at(np.zeros(design.Y.shape[2]))))
    wave = at_lines_per_recording(enumerate_hypotheses(design.problem.arm, (3.0,)), design)[0]
    across = wave.with_nonlinear({"direction": (np.pi / 2,)}, {"direction": (np.pi / 4, 3 * np.pi / 4)})
    off = replace(across, lines={g: f + (-1) ** g * 0.017 for g, f in across.lines.items()})
    search = Search(WeightedLibrary(whitened, Library.of(design, (off,), model)), sizes)
    found = lines_at_peak(search, search.score((0,)), model)
    (k,) = found.best.chosen
    assert [found.search.view.library.hypotheses[k].lines[g] for g in range(6)] == pytest.approx(OTHER_WAVES, abs=0.003)
    assert found.best.score > search.score((0,)).score + 50


def test_lines_that_were_chosen_from_many_cost_the_logarithm_of_how_many():
    one = rig_search(rows(3, joints=1), (law("a"), law("b", log_tried=7.0)))
    assert one.view.library.log_prior(1) == pytest.approx(one.view.library.log_prior(0) - 7.0)
