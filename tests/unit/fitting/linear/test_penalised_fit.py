"""The penalty on bends, how its weight is chosen, and the study that leaves motions out."""

import numpy as np
import pytest
from rigs import arm

from nnhydro.errors import ConfigError
from nnhydro.fitting.linear.penalised_fit import CRITERIA, bend_rows, penalised_fit, penalised_over_scales
from nnhydro.fitting.linear.variable_projection import reduce
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.travel.state_model import bspline_loads, state_loads


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
