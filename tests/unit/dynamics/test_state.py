"""What is no motion of a base, and no step in time, is refused."""

import numpy as np
import pytest
import torch

from nnhydro.dynamics.arrays import Form
from nnhydro.dynamics.state import step_length, surroundings
from nnhydro.errors import ModelError


def test_a_base_gives_every_row_its_motion_and_refuses_other_keys():
    found = surroundings({"base_x_m_s": 0.5, "base_yaw_rad_s": [0.1, 0.2]}, Form((2,), True))
    assert found.current is None
    given = {"dbase_x_m_s2": 2.0, "base_yaw_rad_s": 0.5, "current_y_m_s": 0.1, "dcurrent_y_m_s2": 1.0}
    later = surroundings(given, Form((), True)).after(0.1)
    assert [float(x) for x in (later.base.vx, later.base.heading, later.current.velocity[0, 1])] == pytest.approx([0.2, 0.05, 0.2])
    found = found.base
    torch.testing.assert_close(found.vx, torch.full((2,), 0.5, dtype=torch.float64))
    torch.testing.assert_close(found.rate, torch.tensor([0.1, 0.2], dtype=torch.float64))
    assert not found.heading.any()
    assert surroundings(None, Form((2,), True)) is None
    with pytest.raises(ModelError, match="unknown key"):
        surroundings({"u": 1.0}, Form((), True))


def test_a_step_is_one_positive_number():
    assert step_length(np.float64(0.02)) == 0.02
    with pytest.raises(ModelError, match="one positive step"):
        step_length(0.0)
