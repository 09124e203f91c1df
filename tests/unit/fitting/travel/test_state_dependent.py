"""Curves over the travel with the travel scale searched, and their bands."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch
from rigs import arm
from scipy.stats import norm
from scipy.stats import t as student

from nnhydro.fitting.travel import state_dependent
from nnhydro.fitting.travel.state_dependent import _joint_scale, curve_bands
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.travel.state_model import drag_curve, state_loads, with_tau_s


@pytest.mark.parametrize("count", [2, 3, 12])
def test_bands_of_few_motions_are_wider_as_students_t_is(count, monkeypatch):
    rng = np.random.default_rng(1)
    nus, thetas = np.full(400, 5.0), rng.standard_normal((400, 12))
    monkeypatch.setattr(state_dependent, "bootstrap", lambda *given: (nus, thetas))
    free = with_tau_s(Loads({name: term for name, term in state_loads(arm(1)).terms.items() if name != "rigid_body"}), 5.0)
    told = SimpleNamespace(tau_s=(5.0,), search=SimpleNamespace(grid=(np.linspace(2, 15, 21),)), free=free, loads=free,
                           blocks=lambda nu: np.zeros((count, 3, 3)))
    s = np.array([1.0, 2.5, 4.0])
    low, high = curve_bands(told, s)["C_D"]
    drawn = np.array([drag_curve(free.with_linear(theta), torch.from_numpy(s)).numpy() for theta in thetas])
    middle = drag_curve(free, torch.from_numpy(s)).numpy()
    wider = student.ppf(0.975, count - 1) / norm.ppf(0.975) * np.sqrt(count / (count - 1))
    q = np.quantile(drawn, [0.025, 0.975], axis=0)
    np.testing.assert_allclose(low, middle + wider * np.minimum(q[0] - middle, 0))
    np.testing.assert_allclose(high, middle + wider * np.maximum(q[1] - middle, 0))


def test_joints_count_alike_where_there_are_several():
    tau = torch.tensor([[3.0, 0.0], [-3.0, 0.0]], dtype=torch.float64)
    np.testing.assert_allclose(_joint_scale([(None, tau), (None, tau)]), [3.0, 1.0])
    np.testing.assert_allclose(_joint_scale([(None, tau[:, :1])]), [1.0])
