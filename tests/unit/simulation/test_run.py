"""A run on a fine grid, and one that follows its reference exactly."""

from types import SimpleNamespace

import numpy as np
import pytest
from campaigns import planted
from rigs import arm, assert_close

from nnhydro.errors import ConfigError
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.motion import Motion, tensor
from nnhydro.simulation.motions.motion_kind import Setting, motion_of
from nnhydro.simulation.run import MAX_ROWS, grid, require_length, run_prescribed, stream

A = arm(2)
SLEW = {"kind": "slew", "name": "m", "q_rad": [[0.0, 0.2], [0.8, -0.5]], "duration_s": 0.8, "rest_s": 0.1}
REFERENCE = motion_of(SLEW, "recipe").reference(Setting(A, np.random.default_rng(0), None))


def lasting(seconds):
    return SimpleNamespace(duration=seconds)


def test_the_grid_holds_both_ends_whatever_is_rounded():
    assert grid(lasting(0.3), 10.0).tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert len(grid(lasting(0.1 + 0.2), 10.0)) == 4
    assert len(grid(lasting(0.35), 10.0)) == 4


def test_a_run_is_neither_too_short_nor_too_long():
    require_length(lasting(0.03), 100.0, 1000.0, "m")
    with pytest.raises(ConfigError, match=r"motion 'm': 0.02 s hold fewer than 4 samples"):
        require_length(lasting(0.02), 100.0, 1000.0, "m")
    with pytest.raises(ConfigError, match="are too many steps"):
        require_length(lasting(MAX_ROWS / 1000.0), 100.0, 1000.0, "m")


def test_an_arm_that_follows_its_reference_needs_its_inverse_dynamics():
    run = run_prescribed("m", REFERENCE, A, planted(A), 200.0)
    q, qd, qdd, u0, du0 = (tensor(x) for x in run.state)
    assert_close(tensor(run.tau), planted(A).torque(Flow(A, Motion(tensor(run.t), q, qd, qdd, u0, du0))))
    assert run.t[1] == pytest.approx(1 / 200)


def test_a_term_without_a_finite_torque_is_named_with_its_time():
    broken = Loads({"rub": ViscousTerm((float("inf"), 0.0))})
    with pytest.raises(ConfigError, match=r"motion 'm': terms.rub gives no finite torque at t = "):
        run_prescribed("m", REFERENCE, A, broken, 200.0)


def test_draws_depend_on_seed_name_and_purpose_alone():
    first = stream(3, "run", "motion").standard_normal(4).tolist()
    assert stream(3, "run", "motion").standard_normal(4).tolist() == first
    for other in ((4, "run", "motion"), (3, "run2", "motion"), (3, "run", "sensors")):
        assert stream(*other).standard_normal(4).tolist() != first
