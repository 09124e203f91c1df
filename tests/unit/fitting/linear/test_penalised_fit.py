"""The penalty on bends, how its weight is chosen, and the study that leaves motions out."""

import numpy as np
import pytest
from rigs import arm

from nnhydro.errors import ConfigError
from nnhydro.fitting.linear.penalised_fit import (
    CRITERIA,
    WEIGHTS,
    _score_gcv,
    _score_held_out,
    bend_rows,
    penalised_fit,
    penalised_over_scales,
)
from nnhydro.fitting.linear.variable_projection import reduce
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.travel.state_model import bspline_loads, state_loads

PENALTY = np.array([[1.0, -2.0, 1.0, 0.3], [0.0, 1.0, -1.0, 0.0]])


def bumps(noise, seed=0, blocks=5, count=20):
    """A smooth curve seen through bumps, in blocks of rows."""
    rng, at = np.random.default_rng(seed), np.linspace(0, 1, count)
    truth, parts, samples = np.sin(3 * at), [], 0
    for _ in range(blocks):
        X = np.exp(-((rng.uniform(0, 1, 60)[:, None] - at) / 0.05) ** 2)
        parts.append(reduce(X, X @ truth + noise * rng.standard_normal(60)))
        samples += 60
    P = np.zeros((count - 2, count + 1))
    for k in range(count - 2):
        P[k, k:k + 3] = 1.0, -2.0, 1.0
    return np.stack(parts), samples, P, truth


@pytest.mark.parametrize("criterion", CRITERIA)
def test_the_chosen_weight_is_better_than_none_and_than_too_much(criterion):
    blocks, samples, P, truth = bumps(0.3)
    found = penalised_fit(blocks, samples, P, criterion)
    assert not found.at_bound
    free, stiff = (penalised_fit(blocks, samples, P, criterion, np.array([w])).theta for w in (1e-12, 1e6))
    error = [np.abs(theta - truth).mean() for theta in (found.theta, free, stiff)]
    assert error[0] < 0.5 * error[1]
    assert error[0] < error[2]


def test_noise_asks_for_more_penalty():
    weights = [penalised_fit(*bumps(noise)[:3]).weight for noise in (1e-4, 1.0)]
    assert weights[0] < weights[1]


def test_bend_rows_of_a_straight_curve_vanish():
    loads = Loads({k: v for k, v in bspline_loads(arm(1), 6).terms.items() if k != "rigid_body"})
    rows = bend_rows(loads)
    straight = np.concatenate([np.arange(1, 7) / 6, 1 - np.arange(1, 7) / 6])
    misfit = rows[:, :-1] @ straight - rows[:, -1]
    assert np.abs(misfit).max() == pytest.approx(1 / 6)  # only where the curve must end level
    assert np.count_nonzero(np.abs(misfit) > 1e-12) == 2
    assert bend_rows(state_loads(arm(1))).shape == (12, 12 + 3 + 1)


def test_a_sum_without_curves_and_an_unknown_criterion_are_refused():
    with pytest.raises(ConfigError, match="state_loads"):
        bend_rows(Loads({"drag": NormalDrag((1.0,))}))
    blocks, samples, P, _ = bumps(0.1)
    with pytest.raises(ConfigError, match="gcv, held out"):
        penalised_fit(blocks, samples, P, "bayes")
    with pytest.raises(ConfigError, match="single recording cannot be held out"):
        penalised_fit(blocks[:1], samples, P)


def test_scale_and_weight_are_chosen_together():
    t = np.linspace(0, 10, 100)

    def at(nu):
        return np.stack([reduce(np.exp(-t[k::4, None] / nu[0]), np.exp(-t[k::4] / 2.0)) for k in range(4)])

    nu, fit = penalised_over_scales(at, [np.array([1.0, 2.0, 3.0])], np.array([[1.0, 0.0]]), np.array([1e-8, 1.0]))
    assert nu == (2.0,)
    assert fit.theta[0] == pytest.approx(1.0, abs=1e-3)


def tables(seed=1, blocks=4, rows=30, p=3):
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((blocks, rows, p))
    y = X @ np.array([1.0, -2.0, 0.5])[:p] + 0.5 * rng.standard_normal((blocks, rows))
    return X, y, np.stack([reduce(a, b) for a, b in zip(X, y, strict=True)])


def ridge(X, y, rows):
    stacked = np.vstack([X, rows[:, :-1]])
    return np.linalg.lstsq(stacked, np.concatenate([y, rows[:, -1]]), rcond=None)[0]


@pytest.mark.parametrize("weight", [0.1, 10.0])
def test_the_left_out_score_is_the_misfit_of_blocks_to_fits_without_them(weight):
    X, y, blocks = tables()
    rows = weight * PENALTY
    theta = [ridge(np.delete(X, b, 0).reshape(-1, 3), np.delete(y, b, 0).ravel(), rows) for b in range(4)]
    own = sum(float(((y[b] - X[b] @ theta[b]) ** 2).sum()) for b in range(4))
    assert _score_held_out(blocks, rows) == pytest.approx(own, rel=1e-9)


@pytest.mark.parametrize("weight", [0.1, 10.0])
def test_the_generalised_score_is_that_of_Craven_and_Wahba(weight):
    X, y, blocks = tables()
    Z, z, rows = X.reshape(-1, 3), y.ravel(), weight * PENALTY
    hat = Z @ np.linalg.inv(Z.T @ Z + rows[:, :3].T @ rows[:, :3]) @ Z.T
    left = z - Z @ ridge(Z, z, rows)
    assert _score_gcv(blocks, 120, rows) == pytest.approx(120 * float((left**2).sum()) / (120 - np.trace(hat)) ** 2, rel=1e-9)


def test_a_weight_is_a_pure_number_and_the_best_of_those_tried_is_chosen():
    X, y, blocks = tables()
    found = penalised_fit(blocks, 120, PENALTY, weights=np.array([1e-4, 1e-2, 1.0, 100.0]))
    unit = np.linalg.norm(X) / np.linalg.norm(PENALTY[:, :-1])
    scores = [_score_held_out(blocks, np.sqrt(w) * unit * PENALTY) for w in (1e-4, 1e-2, 1.0, 100.0)]
    np.testing.assert_allclose(found.scores, scores, rtol=1e-6)
    assert found.weight == (1e-4, 1e-2, 1.0, 100.0)[int(np.argmin(scores))]
    np.testing.assert_allclose(found.theta, ridge(X.reshape(-1, 3), y.ravel(), np.sqrt(found.weight) * unit * PENALTY), rtol=1e-6)
    louder = penalised_fit(np.stack([reduce(1e3 * a, 1e3 * b) for a, b in zip(X, y, strict=True)]), 120, PENALTY)
    assert louder.weight == penalised_fit(blocks, 120, PENALTY).weight
    assert (WEIGHTS[0], WEIGHTS[-1]) == (pytest.approx(1e-8), pytest.approx(1e2))
    assert penalised_fit(blocks, 120, PENALTY, weights=np.array([1e9])).at_bound


def test_of_several_scales_the_one_whose_best_weight_predicts_best_is_taken():
    X, y, _ = tables()
    y = np.einsum("brp,p->br", np.exp(2.0 * X), [1.0, 2.0, 3.0]) + y

    def at(nu):
        return np.stack([reduce(np.exp(nu[0] * a), b) for a, b in zip(X, y, strict=True)])

    nu, told = penalised_over_scales(at, [np.array([1.0, 2.0, 3.0])], PENALTY, np.array([1e-6, 1e-3]))
    assert nu == (2.0,)
    assert told.scores.min() == pytest.approx(min(penalised_fit(at((v,)), 1, PENALTY, weights=np.array([1e-6, 1e-3])).scores.min()
                                                  for v in (1.0, 2.0, 3.0)))


def test_bends_stand_at_the_places_of_their_curve_and_drag_begins_at_nothing_inertia_at_one():
    a = arm(1)
    loads = state_loads(a)
    rows, sizes = bend_rows(loads), [len(term.linear_values()) for term in loads.linear().values()]
    assert rows.shape[1] == sum(sizes) + 1
    flat = np.zeros(sum(sizes))
    names, start, curves = list(loads.linear()), 0, []
    for name, size in zip(names, sizes, strict=True):
        if name != "rigid_body":
            curves.append(slice(start, start + size))
        start += size
    drag, mass = curves
    flat[mass] = 1.0
    assert np.abs(rows[:, :-1] @ flat - rows[:, -1]).max() == pytest.approx(0.0, abs=1e-12), "constant from the known start: no bend"
    flat[drag] = 0.7
    assert np.abs(rows[:, :-1] @ flat - rows[:, -1]).max() > 0.1
    assert not rows[:, :-1][:, [k for k in range(sum(sizes)) if not any(c.start <= k < c.stop for c in curves)]].any()
    assert len(bend_rows(bspline_loads(a, 5))) == 10
