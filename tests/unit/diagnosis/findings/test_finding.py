"""What a nonlinear value is known to, from how the score falls beside it."""

from types import SimpleNamespace

import numpy as np
import pytest
from problems import design, law, search

from nnhydro.diagnosis.findings.finding import _bend, _ever_farther


def wave(frequency, direction):
    made = law("wave")
    spans = {"frequency": (0.4, 0.6), "direction": (0.0, 2.0)}
    shape = SimpleNamespace(**vars(made.effect), frequency=(frequency,), direction=(direction,))
    return type(made)(shape, spans=spans)


@pytest.mark.parametrize("direction", [1.0, 2.0])
def test_a_frequency_is_known_by_the_fall_of_the_score_beside_it_in_whatever_direction_others_were_tried(direction):
    laws = (wave(0.5, 1.0), wave(0.49, direction), wave(0.51, direction))
    of = design(0, groups=8, rows=30)
    X = np.random.default_rng(50).standard_normal((*of.y.shape, 3))
    X[..., 1:] = 0.9 * X[..., :1] + 0.4 * X[..., 1:]
    of.y = of.y + X[..., 0]
    one = search(of, laws, X)
    found = one.score((0,))
    drop = found.score - max(one.score((1,)).score, one.score((2,)).score)
    assert drop > 5
    variance, _ = _bend(one, found, laws[0], 0, "frequency", np.ones(1))
    assert np.sqrt(variance) <= 0.01 / np.sqrt(2 * drop) * 1.001 < 0.1 / np.sqrt(3)


def test_neighbours_that_crowd_about_the_best_are_passed_over():
    near = [(step, number) for number, step in enumerate((0.0, 0.1, -0.11, 0.12, 0.2, -1.0, 1.1))]
    assert [step for step, _ in _ever_farther(near)] == [0.1, 0.2, -1.0]
