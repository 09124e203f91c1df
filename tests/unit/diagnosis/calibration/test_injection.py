"""Effects put into a campaign: their torque and new noise of its spectrum, nothing else; phases are turned in every recording."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from problems import design, law, search

from nnhydro.diagnosis.calibration import injection
from nnhydro.diagnosis.calibration.injection import inject, predict_whitened, with_torque
from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.model.evidence import WhiteRows, posterior
from nnhydro.diagnosis.model.sizes import none
from nnhydro.diagnosis.noise.spectrum import white_noise
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary

PLAIN, PHASED = law("plain"), law("phased", 2, per_recording=True)


@dataclass
class Rows:
    """Stands for a design: what is injected needs rows alone."""

    problem: SimpleNamespace
    baseline: None
    Y: np.ndarray
    y: np.ndarray
    tau: np.ndarray


@pytest.fixture
def of(monkeypatch):
    """Rows of six recordings on which `PLAIN` has a column and `PHASED` two."""
    monkeypatch.setattr(injection, "Design", Rows)
    made = design(61, groups=6, rows=40, noise=3.0)
    made.tau = made.y + 7.0  # of which the baseline holds 7 at z = 0
    X = {PLAIN: np.random.default_rng(62).standard_normal((*made.y.shape, 1))}
    X[PHASED] = np.stack([[1.0, 0.0] + 0 * made.y, [0.0, 1.0] + 0 * made.y], axis=2)  # one value per joint
    made.columns = lambda hypotheses, model: np.concatenate([X[h] for h in hypotheses], axis=2)
    made.baseline, made.X = None, X
    return made


def test_an_injected_effect_adds_its_torque_and_nothing_else(of):
    z, noise = np.array([0.2, -0.1]), white_noise(of)
    bare, loaded = (inject(of, noise, None, z, effects, 3) for effects in ([], [(PLAIN, np.array([0.4]))]))
    np.testing.assert_allclose(loaded.y - bare.y, 0.4 * of.X[PLAIN][..., 0], atol=1e-12)
    np.testing.assert_allclose(loaded.tau - loaded.y, of.tau - of.y, atol=1e-12, err_msg="what the baseline holds at z = 0 stays")
    rest = (bare.y - of.Y @ z) / np.sqrt(noise.noise_variance)
    assert (rest**2).mean() == pytest.approx(1.0, abs=0.1)


def test_the_same_seed_draws_the_same_noise_and_another_seed_another(of):
    z, noise = np.zeros(2), white_noise(of)
    one, again, other = (inject(of, noise, None, z, [], seed).y for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, again)
    assert np.abs(one - other).min() > 0


def test_values_of_each_recording_s_own_keep_their_size_and_point_anywhere(of):
    z, noise, values = np.zeros(2), white_noise(of), np.array([3.0, 4.0])
    drawn = inject(of, noise, None, z, [(PHASED, values)], 5).y - inject(of, noise, None, z, [], 5).y
    turned = np.array([drawn[of.problem.group_of == g][0] for g in range(6)])
    for g in range(6):
        np.testing.assert_allclose(drawn[of.problem.group_of == g], np.tile(turned[g], (40, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), 5.0)
    assert (turned < 0).any(axis=0).all()
    assert (turned > 0).any(axis=0).all()
    assert np.abs(np.diff(np.arctan2(*turned.T))).min() > 1e-3


def test_products_with_another_torque_are_those_of_rows_with_that_torque(of):
    of = design(63)
    one = search(of, (PLAIN, PHASED), even=False)
    view, y = one.view, np.random.default_rng(64).standard_normal(of.y.shape)
    t = none(view.whitened).vector(view.whitened)
    view.gains((0, 1), posterior(view.whitened, view.join((0, 1)), t))  # all that a view caches
    before = view.whitened.yy
    made = with_torque(view, y)
    fresh = WeightedLibrary(WhiteRows(SimpleNamespace(**{**vars(of), "y": y / view.whitened.sw}), view.whitened.unknown, view.whitened.v),
                            view.library)
    np.testing.assert_allclose(made.whitened.b, fresh.whitened.b)
    np.testing.assert_allclose(made.Xy, fresh.Xy)
    assert made.whitened.yy == pytest.approx(fresh.whitened.yy)
    for k in (0, 1):
        np.testing.assert_allclose(made.columns(k).Xy, fresh.columns(k).Xy)
    np.testing.assert_allclose(made.gains((), posterior(made.whitened, None, t)), fresh.gains((), posterior(fresh.whitened, None, t)))
    assert view.whitened.yy == before, "the campaign at hand stays as it is"


def test_what_a_fit_predicts_is_its_baseline_its_effects_and_the_unknown_of_what_remains():
    of = design(65, groups=6, rows=40)
    one = search(of, (PLAIN,), even=False)
    found, rest = one.score((0,)), one.score(())
    white = one.whitened
    got = predict_whitened(one.view, found, rest)
    D = np.concatenate([white.Y, one.view.columns(0).Xw], axis=2).reshape(white.y.size, -1)
    ridge = np.linalg.solve(D.T @ D + np.diag([1.0, 1.0, RHO**-2]), D.T @ white.y.ravel())
    eta = rest.fit.mean[white.p:white.p + 2 * white.m].reshape(2, white.m)
    unknown = white.sw * (white.Phi @ eta.T)
    np.testing.assert_allclose(got, (D @ ridge).reshape(white.y.shape) + unknown, atol=1e-5)
