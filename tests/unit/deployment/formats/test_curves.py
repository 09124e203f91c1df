"""Curves out: those of the model."""

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted
from rigs import arm
from untrained import learned

import nnhydro
from nnhydro.deployment.formats.curves import coefficient_rows
from nnhydro.errors import ConfigError, ModelError
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.travel.state_model import added_mass_curve, drag_curve, state_loads


def save(model, folder):
    from nnhydro.models.storage import save_model
    return save_model(model, folder)


def test_the_curves_are_those_of_the_model(tmp_path):
    a = arm()
    model = StripTheory(a, GIVEN, {}, "state", state_loads(a))
    rows = np.array(list(coefficient_rows(model)))
    for link in range(2):
        own = rows[rows[:, 1] == link + 1]
        s = torch.tensor(own[:, 0])
        np.testing.assert_allclose(own[:, 2], drag_curve(model.loads, s, link))
        np.testing.assert_allclose(own[:, 3], added_mass_curve(model.loads, s, link))
    level = np.array(list(coefficient_rows(StripTheory(a, GIVEN, {}, "constant", planted(a)))))
    assert set(level[level[:, 1] == 2][:, 2]) == {1.3}
    assert nnhydro.load_model(save(model, tmp_path / "m")).export(tmp_path / "c.csv") == ()
    assert (tmp_path / "c.csv").read_text().splitlines()[0] == "s_over_D,link,C_D,C_M"
    with pytest.raises(ConfigError, match=r"\.onnx, \.xml or \.csv"):
        nnhydro.load_model(tmp_path / "m").export(tmp_path / "c.txt")


def test_a_model_without_coefficients_is_refused_and_one_without_added_mass_has_none(tmp_path):
    a = arm(1)
    level = np.array(list(coefficient_rows(StripTheory(a, GIVEN, {}, "drag", Loads({"normal_drag": NormalDrag((1.1,))})))))
    assert set(level[:, 2]) == {1.1}
    assert set(level[:, 3]) == {0.0}
    with pytest.raises(ModelError, match="a network has no coefficient curves"):
        next(coefficient_rows(learned(a, hybrid=False)))
