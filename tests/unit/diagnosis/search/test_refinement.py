"""Values between those of the grid: the peak of the score, and a wave that is taken about each recording's own values."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oscillations import by_scipy, with_oscillation
from rigs import arm

from nnhydro.diagnosis.problem.hypothesis import enumerate_hypotheses, refine_grid
from nnhydro.diagnosis.search.refinement import _ends, at_peak, refine

WAKE = next(h for h in enumerate_hypotheses(arm(1), (3.0,)) if h.key[0] == "wake_development")
(NAME,) = WAKE.spans


def scored(h, truth, width):
    """The neighbours of `h` with scores that fall with the square of the distance to `truth` in the logarithm."""
    def score(o):
        return -((np.log(getattr(o.effect, NAME)[0] / truth) / width) ** 2)

    return score(h), [(o, score(o)) for o in refine_grid(h)[1:]]


def test_a_contact_that_does_not_bend_is_not_asked_to_bend_backwards():
    stiff = next(h for h in enumerate_hypotheses(arm(1), (3.0,)) if h.key[0] == "load_friction" and h.effect.bending == (0.0,))
    assert stiff.spans["bending"][0] < 0, "as far below as its neighbour lies above"
    (bent,) = _ends(stiff)
    assert bent.effect.bending == (stiff.spans["bending"][1],)


@given(share=st.floats(-0.95, 0.95), width=st.floats(0.01, 10.0))
@settings(max_examples=40)
def test_where_scores_are_a_parabola_its_vertex_is_found_at_once(share, width):
    value = getattr(WAKE.effect, NAME)[0]
    low, high = (getattr(o.effect, NAME)[0] for o in refine_grid(WAKE)[1:])
    truth = value * ((high if share > 0 else low) / value) ** abs(share)
    made = at_peak(WAKE, *scored(WAKE, truth, width))
    got = value if made is None else getattr(made.effect, NAME)[0]
    assert got == pytest.approx(truth, rel=1e-6)
    if made is not None:
        assert made.spans[NAME] == pytest.approx((low, high))


def test_beyond_the_neighbours_nothing_is_guessed():
    end = getattr(refine_grid(WAKE)[-1].effect, NAME)[0]
    made = at_peak(WAKE, *scored(WAKE, 100 * getattr(WAKE.effect, NAME)[0], 1.0))
    assert made is None or getattr(made.effect, NAME)[0] <= end
    alone = replace(WAKE, spans={NAME: (getattr(WAKE.effect, NAME)[0],) * 2})
    assert at_peak(alone, 0.0, []) is None


def test_refinement_ends_where_all_values_fit_best_together():
    one = with_oscillation((1.05, 0.6), (1.0, 0.4))
    grown = refine(one, one.score((0,)), None, rounds=0)
    (k,) = grown.best.chosen
    best, deviation = by_scipy(one, (1.05, 0.6))
    effect = grown.search.view.library.hypotheses[k].effect
    assert np.all(np.abs([effect.frequency[0], effect.damping[0]] - best) < 0.4 * deviation)
