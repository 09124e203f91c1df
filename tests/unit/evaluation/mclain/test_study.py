"""A study leaves each motion out: the true form predicts it, and each phase has an error of its own."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from rigs import arm

from nnhydro.evaluation.mclain.study import PHASES, Candidate, TowedMotion, fit_and_predict, leave_one_out
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.travel.state_model import bspline_loads, drag_curve, state_loads


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


def test_each_motion_is_predicted_from_the_others_alone():
    constants = Loads({"d": NormalDrag((1.0,)), "m": AddedMass((1.0,))})
    one = towed("one", 0.4, 4.0, constants)
    outcome = leave_one_out(Candidate("constants", constants), [one, replace(one, name="in twice as dense water", tau=2 * one.tau)])
    assert outcome.by_motion == pytest.approx({"one": 1.0, "in twice as dense water": 0.5}, abs=1e-6)


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
