"""Nonlinear values are known as well as a least-squares fit of all values knows them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from oscillations import by_scipy, columns, moved, with_oscillation

from nnhydro.diagnosis.search.best_fit import fit_at
from nnhydro.diagnosis.search.tangents import FINEST, _first_step, limits_of, step_of, tangents_of
from nnhydro.diagnosis.search.values import values_of


@pytest.mark.parametrize("per_recording", [False, True])
def test_columns_are_the_derivatives_of_the_torque(per_recording):
    beta = np.outer(np.arange(1, 9), [0.8, -0.4]) if per_recording else np.array([0.8, -0.4])
    one = with_oscillation((1.05, 0.6), (1.05, 0.6), beta=beta, noise=0.01, per_recording=per_recording)
    of = one.whitened.design
    each = np.broadcast_to(beta, (8, 2))[of.problem.group_of]
    tangents = tangents_of(one, one.score((0,)))
    for i, step in enumerate(((1e-4, 0.0), (0.0, 1e-4))):
        more, less = (np.einsum("njk,nk->nj", columns(of, 1.05 + way * step[0], 0.6 + way * step[1]), each) for way in (1, -1))
        assert tangents.D[..., i] == pytest.approx((more - less) / 2e-4, abs=0.02 * np.abs(tangents.D[..., i]).max())


def test_what_the_data_do_not_tell_may_lie_anywhere_between_its_limits():
    one = with_oscillation((1.05, 0.6), (1.05, 0.6))
    tangents = tangents_of(one, one.score((0,)))
    step = step_of(one, one.score((0,)), replace(tangents, D=0 * tangents.D))
    assert step.deviation == pytest.approx(np.array([4.0, 3.5]) / np.sqrt(12)), "of what is even between them"
    assert np.all(step.phi == 0)


def test_a_value_lies_between_its_bounds_and_the_neighbours_of_all_that_was_tried():
    assert limits_of(with_oscillation((1.05, 0.6), (1.0, 0.5)), 0) == {"frequency": (0.1, 4.1), "damping": (0.0, 3.5)}


def test_an_end_that_is_the_value_but_for_rounding_is_no_neighbour():
    """A step of that size has the same value on both sides, and the difference quotient of it is no number."""
    one = with_oscillation((1.05, 0.6), (1.05, 0.6))
    h = one.view.library.hypotheses[0]
    value = h.effect.frequency[0]
    rounded = replace(h, spans=h.spans | {"frequency": (np.nextafter(value, 9.0), value + 0.5)})
    assert _first_step(rounded, "frequency") == pytest.approx(0.5)
    held = replace(h, spans=h.spans | {"frequency": (value, np.nextafter(value, 9.0))})
    assert "frequency" not in limits_of(SimpleNamespace(view=SimpleNamespace(library=SimpleNamespace(hypotheses=[held]))), 0)


def test_no_step_leads_beyond_what_was_tried():
    for seed in range(4):
        one = with_oscillation((1.05, 0.0), (1.05, 0.05), noise=0.5, seed=seed)
        step = step_of(one, one.score((0,)), tangents_of(one, one.score((0,))))
        assert step.tangents.now[1] + step.phi[1] >= -1e-12


@pytest.mark.parametrize("per_recording", [False, True])
def test_deviations_are_those_of_a_least_squares_fit_of_all_values(per_recording):
    one = with_oscillation((1.05, 0.6), (1.05, 0.6), noise=0.1, per_recording=per_recording)
    one.best_fits[(0,)] = fit_at(one, one.score((0,)), one.whitened.v)
    values = values_of(one, one.score((0,)), 0, tangents_of(one, one.score((0,))))
    _, deviation = by_scipy(one, (1.05, 0.6))
    at = [2 + values.names.index(name) for name in ("frequency", "damping")]
    ratio = np.sqrt(np.diag(values.covariance)[at]) / deviation
    assert np.all(ratio > 0.98)  # never less; more where recordings scatter, or have phases of their own
    assert np.all(ratio < (2.5 if per_recording else 1.8))


def test_intervals_of_nonlinear_values_hold_the_truth():
    inside = []
    for seed in range(25):
        search, found, k, effect = moved(with_oscillation((1.05, 0.6), (1.0, 0.5), seed=seed, rows=40))
        values = values_of(search, found, k, tangents_of(search, found))
        deviation = np.sqrt(np.diag(values.covariance)[2 + values.names.index("frequency")])
        inside.append(abs(effect.frequency[0] - 1.05) < 1.96 * deviation)
    assert 21 <= sum(inside) <= 25
    assert deviation < 0.05


def test_a_law_that_jumps_gets_a_slope_over_a_finite_step(monkeypatch):
    one = with_oscillation((1.05, 0.6), (1.05, 0.6), noise=0.1)
    steps_tried = []

    def jump(search, found, steps):  # the same jump over every step, however small
        steps_tried.append(dict(steps))
        jumped = np.random.default_rng(0).standard_normal((*search.view.library.design.y.shape, len(steps)))
        return jumped * 1e6 / np.array(list(steps.values()))

    monkeypatch.setattr("nnhydro.diagnosis.search.tangents._columns", jump)
    tangents = tangents_of(one, one.score((0,)))
    assert np.all(np.isfinite(tangents.D))
    first = steps_tried[0]
    assert all(steps[at] >= FINEST * first[at] for steps in steps_tried for at in first)


def test_what_a_law_does_over_a_step_is_computed_once_for_all_sets_that_hold_it(monkeypatch):
    one = with_oscillation((1.05, 0.6), (1.05, 0.6), noise=0.1)
    held = tuple(replace(h, working_model=SimpleNamespace()) for h in one.view.library.hypotheses)
    one.view = replace(one.view, library=replace(one.view.library, hypotheses=held))
    first = tangents_of(one, one.score((0,))).D
    one.tangents.clear()
    monkeypatch.setattr(one.view.library.design, "columns", None)
    again = tangents_of(one, one.score((0,))).D
    assert np.array_equal(again, first)
