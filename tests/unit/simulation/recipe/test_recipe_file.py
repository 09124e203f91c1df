"""The keys of a recipe file: rates that fit into each other, and limits of the rig."""

import numpy as np
import pytest

from nnhydro.errors import ConfigError
from nnhydro.recordings.readers.validation import validate
from nnhydro.simulation.motions.motion_kind import State
from nnhydro.simulation.recipe.recipe_file import FINE_HZ, MotionLimits, RecipeFile

PD = {"kind": "pd", "kp": 10.0, "kd": 1.0}


def made(**keys):
    return validate(RecipeFile, {"arm": "arm.yaml", "motions": [{}], **keys}, "recipe", ConfigError)


@pytest.mark.parametrize(("rate", "steps"), [(100.0, 10), (300.0, 4), (1000.0, 1), (4000.0, 1)])
def test_the_fine_grid_is_at_least_as_fine_as_its_usual_rate(rate, steps):
    file = made(sample_rate_hz=rate)
    assert file.steps == steps
    assert file.fine_rate_hz == rate * steps >= min(FINE_HZ, file.fine_rate_hz)


def test_a_controller_acts_once_a_sample_or_at_a_rate_that_divides_the_grid():
    assert made(sample_rate_hz=100, substeps=4).hold == 4
    assert made(sample_rate_hz=100, substeps=4, controller={**PD, "rate_hz": 200}).hold == 2
    with pytest.raises(ConfigError, match="rate_hz must divide the simulation's 400 Hz"):
        made(sample_rate_hz=100, substeps=4, controller={**PD, "rate_hz": 300})
    assert made(controller="none").controller is None


def test_a_state_outside_the_limits_is_named_with_joint_time_and_value():
    t = np.array([0.0, 0.1])
    state = State(np.array([[0.0, 0.2], [0.1, 0.6]]), np.zeros((2, 2)), np.zeros((2, 2)), np.array([0.0, -0.3]), np.zeros(2))
    MotionLimits(q_rad=((-1, 1), (-1, 0.6))).require_within(state, t, "m")
    with pytest.raises(ConfigError, match=r"motion 'm': q2_rad = 0.6 at t = 0.1 s is outside the limits -1 to 0.5"):
        MotionLimits(q_rad=((-1, 1), (-1, 0.5))).require_within(state, t, "m")
    with pytest.raises(ConfigError, match=r"u0_m_s = -0.3 at t = 0.1 s"):
        MotionLimits(u0_m_s=0.2).require_within(state, t, "m")
    with pytest.raises(ConfigError, match=r"limits\.q_rad: 1 pair"):
        MotionLimits(q_rad=((-1, 1),)).require_within(state, t, "m")
