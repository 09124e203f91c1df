"""The penalty on bends, how its weight is chosen, and the study that leaves motions out."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from rigs import arm

from nnhydro.errors import ConfigError
from nnhydro.evaluation.mclain.study import PHASES, Candidate, TowedMotion, fit_and_predict, leave_one_out
from nnhydro.fitting.linear.penalised_fit import CRITERIA, bend_rows, penalised_fit, penalised_over_scales
from nnhydro.fitting.linear.variable_projection import reduce
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.travel.state_model import bspline_loads, drag_curve, state_loads


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


def towed(name, top, T, loads, stop=False):
    """A start from rest to `top` m/s (and back to rest, and back again) with torques of `loads`, one link across the tow."""
    t = np.linspace(0, T, 301)
    u = top * (np.sin(2 * np.pi * t / T) if stop else np.minimum(t / (0.4 * T), 1.0))
    du = np.gradient(u, t)
    still = torch.zeros(301, 1, dtype=torch.float64)
    flow = Flow(arm(1), Motion(tensor(t), still, still, still, tensor(u), tensor(du)))
    return TowedMotion(name, flow, loads.torque(flow).numpy(), np.abs(u) > 0.02 * top)


def water(loads):
    return Loads({name: term for name, term in loads.terms.items() if name != "rigid_body"})


TRUTH = water(state_loads(arm(1), tau_s=6.0))
MOTIONS = [towed(f"m{k}", top, T, TRUTH) for k, (top, T) in enumerate([(0.2, 4.0), (0.4, 2.0), (0.3, 6.0), (0.5, 3.0), (0.6, 1.0)])]


def test_the_true_form_predicts_what_was_left_out_and_constants_do_not():
    scale = (np.linspace(2, 12, 11),)
    curves = leave_one_out(Candidate("curves", water(state_loads(arm(1))), scale), MOTIONS)
    constants = leave_one_out(Candidate("constants", Loads({"d": NormalDrag((1.0,)), "m": AddedMass((1.0,))})), MOTIONS)
    assert curves.error < 1e-3 < 0.05 < constants.error
    assert set(curves.by_motion) == {m.name for m in MOTIONS}
    assert set(curves.by_phase) == set(PHASES[:2])


def test_penalised_curves_are_fitted_too_and_unseen_reversals_have_a_phase_of_their_own():
    weights = np.geomspace(1e-8, 1e-2, 4)
    free = Candidate("b", water(bspline_loads(arm(1), 8, 6.0)), (np.array([6.0]),), weights)
    back = towed("back", 0.3, 6.0, TRUTH, stop=True)
    fitted, outcome = fit_and_predict(free, MOTIONS, [back])
    s = torch.linspace(0, 5, 11, dtype=torch.float64)
    torch.testing.assert_close(drag_curve(fitted, s), drag_curve(TRUTH, s), rtol=0, atol=0.1)
    assert PHASES[3] in outcome.by_phase
    kept, exact = fit_and_predict(Candidate("truth", TRUTH, fitted=False), MOTIONS, [back])
    assert kept is TRUTH
    assert exact.error == pytest.approx(0.0, abs=1e-12)


def test_with_linear_puts_values_where_they_belong():
    changed = TRUTH.with_linear(np.arange(12.0))
    assert changed.terms["state_drag"] == replace(TRUTH.terms["state_drag"], **{f"d{i + 1}": (float(i),) for i in range(5)}, ds=(5.0,))
