"""Errors on recordings held out: predicted by the fit to the others, measured as McLain and Rock do, beside the error of noise alone."""

from types import SimpleNamespace

import numpy as np
import pytest
from problems import design, law, search

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.decision import heldout_errors
from nnhydro.diagnosis.decision.heldout import fold_of_rows, unit_held_out
from nnhydro.diagnosis.decision.heldout_errors import HeldoutErrors, fitted_error, measure_errors, noise_error
from nnhydro.diagnosis.search.best_fit import best_fit

LAWS = (law("a"), law("phased", per_recording=True))


@pytest.fixture
def one(monkeypatch):
    """A search on eight recordings in which the first law acts; what is predicted and rows in time are the rows themselves."""
    of = design(51, groups=8, rows=30)
    X = np.random.default_rng(52).standard_normal((*of.y.shape, 2))
    of.y = of.tau = of.y + 0.8 * X[..., 0]
    of.undriven, of.heavy, of.part_scale = False, False, np.array([10.0, 30.0])
    of.columns = lambda hypotheses, model, predicted: X[..., [LAWS.index(h) for h in hypotheses]]
    of.problem.blocks = [SimpleNamespace(steady=False) for _ in range(16)]
    monkeypatch.setattr(heldout_errors, "_in_time", lambda design, rows: [rows])
    monkeypatch.setattr(heldout_errors, "_residuals", lambda design, in_time: [])
    return search(of, LAWS, X)


def predicted_by_hand(one, with_law):
    """The rows of baseline and law, each fold by weighted ridge regression on the others with the priors as penalties."""
    v = best_fit(one, one.score((0,) if with_law else ())).whitened.v
    of, fold = one.view.library.design, fold_of_rows(one.view, 0, unit_held_out(one.view, [0]))
    parts = [of.Y, one.view.library.columns(0)] if with_law else [of.Y]
    D, made = np.concatenate(parts, axis=2), np.zeros_like(of.y)
    penalty = np.array([1.0] * of.Y.shape[2] + [RHO**-2] * with_law)
    for number in set(fold.tolist()):
        rows = fold != number
        flat = D[rows].reshape(-1, D.shape[2])
        weighted = flat.T / v[rows].ravel()
        made[~rows] = D[~rows] @ np.linalg.solve(weighted @ flat + np.diag(penalty), weighted @ of.y[rows].ravel())
    return made


def test_errors_held_out_are_sums_of_misfits_over_sums_of_torques_each_recording_predicted_from_the_others(one):
    of = one.view.library.design
    found = measure_errors(one, one.score((0,)), None, 0)
    before, after = (np.abs(of.y - predicted_by_hand(one, law_)).sum() / np.abs(of.tau).sum() for law_ in (False, True))
    assert found.before == pytest.approx(before, rel=1e-5)
    assert found.after == pytest.approx(after, rel=1e-5)
    assert found.after < 0.9 * found.before
    assert found.without == {("a", 0): pytest.approx(before, rel=1e-5)}, "without its only claim the model is the baseline"
    assert (found.scale, found.unit) == ("measured torque", "recordings")


@pytest.mark.parametrize(("heavy", "scale"), [(True, "weight"), (False, "inertia")])
def test_where_nothing_is_driven_errors_are_shares_of_the_largest_part_of_the_model(one, heavy, scale):
    of = one.view.library.design
    of.undriven, of.heavy = True, heavy
    found = measure_errors(one, one.score(()), None, 0)
    misfit = np.abs(of.y - predicted_by_hand(one, False)).sum(axis=0).sum()
    assert found.before == pytest.approx(misfit / (len(of.y) * of.part_scale.sum()), rel=1e-5)
    assert found.scale == scale


def test_a_simulation_has_an_error_of_its_own_before_anything_is_fitted_beside_it(one):
    of = one.view.library.design
    assert measure_errors(one, one.score(()), None, 0).as_given is None, "physics of ours is always recalibrated"
    of.baseline.is_physics = False
    found = measure_errors(one, one.score(()), None, 0)
    assert found.as_given == pytest.approx(np.abs(of.y).sum() / np.abs(of.tau).sum())


def test_the_errors_say_what_was_held_out(one):
    of = one.view.library.design
    assert measure_errors(one, one.score((1,)), None, 0).unit == "stretches of recordings", "only its own recording tells its phase"
    of.problem.block_of = of.problem.group_of
    assert measure_errors(one, one.score((1,)), None, 0).unit == "frequencies of recordings"


def test_the_error_of_a_fit_to_all_is_less_than_that_held_out_by_the_parameters_that_it_has(one):
    found = one.score((0,))
    fitted = fitted_error(one, found, held := measure_errors(one, found, None, 0))
    assert fitted < held.after
    assert fitted == pytest.approx(held.after, rel=0.05)


def test_the_error_of_a_perfect_model_is_the_mean_of_what_noise_alone_leaves():
    rng, sigma, n, dt = np.random.default_rng(0), np.array([0.3, 0.1]), 4000, 0.01
    problem = SimpleNamespace(blocks=[SimpleNamespace(start=0, stop=n, stretch=0, steady=False)], block_of=np.zeros(n, int),
                              stretches=[SimpleNamespace(segment=SimpleNamespace(dt=dt))])
    one = SimpleNamespace(view=SimpleNamespace(library=SimpleNamespace(design=SimpleNamespace(problem=problem))))
    noise = sigma * rng.standard_normal((n, 2))
    own = np.tile(sigma**2 * dt, (n, 1))  # of a row of the orthonormal transform scaled by the root of dt
    got = noise_error(one, HeldoutErrors(0, 0, {}, [], [], torque=2.0, recordings=1), own)
    assert got == pytest.approx(np.abs(noise).mean() / 2.0, rel=0.03)
