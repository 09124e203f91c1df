"""Controllers in the simulator: what each is for, models inside, memory of truth and model, sampling, delay, saturation, encoders."""

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted
from controlled_runs import SLEW, run
from rigs import arm

from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.effects.hypotheses.buoyancy_tilt import BuoyancyTilt
from nnhydro.errors import ConfigError, ModelError
from nnhydro.models.storage import save_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.simulation.controller import Controller
from nnhydro.simulation.motions.motion_kind import Setting, motion_of
from nnhydro.simulation.plant import require_steps
from nnhydro.simulation.recipe.true_loads import true_loads
from nnhydro.simulation.run import Run

QUICK = 200.0  # Hz, of controllers that are unstable or loose where they are sampled at RATE


def worst(r: Run) -> float:
    """Largest tracking error in rad of the slew above."""
    made = motion_of(SLEW, "recipe").reference(Setting(arm(2), np.random.default_rng(0), None))
    return float(np.abs(r.state.q - made.at(np.minimum(r.t, made.duration)).q).max())


@pytest.mark.slow
def test_under_a_controller_a_truth_with_memory_is_what_its_inverse_dynamics_says_of_the_run():
    a = arm(2)
    for loads in (state_loads(a), state_loads(a, at_reversal="decay")):
        require_steps(loads, a)
        r = run(loads, motion={**SLEW, "duration_s": 0.4}, kind="pd", kp=60, kd=5)
        q, qd, qdd, u0, du0 = (tensor(x) for x in r.state)
        inverse = loads.torque(Flow(a, Motion(tensor(r.t), q, qd, qdd, u0, du0)))
        np.testing.assert_allclose(r.tau, inverse, atol=1e-9)


@pytest.mark.slow
def test_the_better_the_model_inside_the_smaller_the_tracking_error(tmp_path):
    a = arm(2)
    truth = state_loads(a)
    save_model(StripTheory(a, GIVEN, {}, "state", truth), tmp_path / "model")
    gains = {"kp": 100.0, "kd": 20.0}
    errors = [worst(run(truth, tmp_path, rate=50.0, kind="computed_torque", model=name, **gains)) for name in ("dry", "textbook", "model")]
    assert errors[2] < 0.5 * errors[1] < 0.5 * errors[0]


@pytest.mark.slow
def test_a_sliding_mode_holds_the_arm_within_its_boundary_layer_against_a_wrong_model():
    a = arm(2)
    r = run(planted(a), rate=QUICK, kind="sliding_mode", kp=[30.0, 8.0], slope=10.0, boundary=0.5)
    assert worst(r) < 0.5 / 10.0
    assert worst(r) < worst(run(planted(a), rate=QUICK, kind="computed_torque", kp=25.0, kd=10.0)) / 3


@pytest.mark.slow
def test_a_boundary_layer_too_thin_for_the_delay_chatters():
    """As a loop through an integrator and a delay T does beyond kp T/(boundary m) = pi/2, m the smallest inertia that a joint can feel."""
    kp, late = np.array([8.0, 3.0]), 1.5 / QUICK  # a period of delay, and half of one as the torque is held
    inertia = 1 / np.diag(np.linalg.inv(Dynamics(StripTheory(arm(2), GIVEN, {}, "", planted(arm(2)))).mass_matrix(np.zeros(2))))
    thin, wide = (run(planted(arm(2)), rate=QUICK, kind="sliding_mode", kp=list(kp), slope=10.0, delay_s=1 / QUICK,
                      boundary=list(kp * late / (loop * np.pi / 2 * inertia))) for loop in (2.0, 0.5))
    assert np.abs(np.diff(thin.tau, axis=0)).mean() > 5 * np.abs(np.diff(wide.tau, axis=0)).mean()
    assert worst(thin) > worst(wide)


@pytest.mark.slow
def test_an_integral_takes_away_what_a_steady_load_leaves():
    loads = planted(arm(2)).plus("lean", BuoyancyTilt((0.0, 0.0), (5.0, 2.0)))
    still = {**SLEW, "q_rad": [[0.0, 0.2], [0.01, 0.2]], "duration_s": 0.1, "rest_s": 0.4}
    plain, integral = (run(loads, None, still, QUICK, kind="pid", kp=60.0, kd=14.0, ki=ki) for ki in (0.0, 300.0))
    goal = np.array([0.01, 0.2])
    off, left = (np.abs(r.state.q[-40:].mean(axis=0) - goal).max() for r in (plain, integral))
    assert left < 0.5 * off


def test_what_does_not_fit_is_refused_in_one_line(tmp_path):
    with pytest.raises(ConfigError, match="neither dry"):
        run(planted(arm(2)), tmp_path, kind="computed_torque", kp=1.0, model="nowhere")
    with pytest.raises(ValueError, match="belongs to computed_torque"):
        Controller(kind="pd", kp=1.0, model="textbook")
    with pytest.raises(ValueError, match="boundary must be positive"):
        Controller(kind="sliding_mode", kp=1.0, boundary=0.0)
    a = arm(3)
    save_model(StripTheory(a, GIVEN, {}, "rigid", planted(a)), tmp_path / "three")
    with pytest.raises(ConfigError, match=r"3 joint\(s\)"):
        run(planted(arm(2)), tmp_path, kind="computed_torque", kp=1.0, model="three")
    (tmp_path / "empty").mkdir()
    with pytest.raises(ModelError, match="no model"):
        run(planted(arm(2)), tmp_path, kind="computed_torque", kp=1.0, model="empty")


def test_a_recipe_takes_a_truth_with_memory_and_a_controller():
    of = arm(2)
    travel = dict.fromkeys(("state_drag", "state_added_mass", "state_at_rest"), "start")
    loads = true_loads({**travel, "history_force": {"C_H": 1.0}}, of, "r")
    require_steps(loads, of)
    assert torch.is_tensor(loads.torque(Flow(of, Motion.at([[0.1, 0.2]], 1.0, 1.0))))
