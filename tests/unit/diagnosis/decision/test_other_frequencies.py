"""A wave stands out from the frequencies about it; what no line holds does not."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import campaign

from nnhydro.diagnosis.constants import LEAVES
from nnhydro.diagnosis.decision.other_frequencies import share_elsewhere
from nnhydro.diagnosis.model.unknown import unknown_of
from nnhydro.diagnosis.noise.spectrum import calibrated_noise
from nnhydro.diagnosis.problem.hypothesis import enumerate_hypotheses
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.wave_frequencies import at_lines, at_lines_per_recording, line_frequencies
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary
from nnhydro.recordings.campaign import Campaign


def elsewhere(of, lines_of):
    """The share that another frequency explains of what the best wave of a campaign does."""
    design = design_on(problem_of(of), None)
    _, whitened, sizes, model = calibrated_noise(design, unknown_of(design, design.baseline.at(np.zeros(design.Y.shape[2]))))
    search = Search(WeightedLibrary(whitened, Library.of(design, lines_of(design), model)), sizes)
    best = max((search.score((k,)) for k in range(len(search.view.library.hypotheses))), key=lambda scored: scored.score)
    return share_elsewhere(search, search.score(()), best.chosen[0])


def waves(design):
    """Waves at the lines of a campaign, from all sides."""
    return at_lines(enumerate_hypotheses(design.problem.arm, (3.0,)), line_frequencies(design))


def waves_apart(design):
    """Waves at the line of each recording."""
    return at_lines_per_recording(enumerate_hypotheses(design.problem.arm, (3.0,)), design)


@pytest.mark.parametrize(("name", "lines_of"), [("held in a wave", waves), ("held in other waves", waves_apart)])
def test_a_wave_explains_little_at_another_frequency(name, lines_of):
    assert elsewhere(campaign(name), lines_of) < LEAVES / 3


def test_a_torque_without_a_line_is_explained_as_well_at_another_frequency():
    of, rng = campaign("held in a wave"), np.random.default_rng(5)
    made = []
    for recording in of.recordings():
        f = np.fft.rfftfreq(len(recording.t), recording.t[1] - recording.t[0])
        spectrum = np.where((f > 0) & (f < 1.5), rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f)), 0)
        rough = np.fft.irfft(spectrum, len(recording.t))
        made.append(replace(recording, tau=recording.tau * 0 + 3 * (rough / rough.std())[:, None]))
    assert elsewhere(Campaign.of(of.arm, made), waves) > LEAVES


def test_a_law_without_a_frequency_has_no_other():
    design = design_on(problem_of(campaign("held in a wave")), None)
    _, whitened, sizes, model = calibrated_noise(design, unknown_of(design, design.baseline.at(np.zeros(design.Y.shape[2]))))
    friction = next(h for h in enumerate_hypotheses(design.problem.arm, (3.0,)) if h.key[0] == "viscous_friction")
    search = Search(WeightedLibrary(whitened, Library.of(design, (friction,), model)), sizes)
    assert share_elsewhere(search, search.score(()), 0) == 0.0
