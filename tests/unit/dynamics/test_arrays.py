"""Numbers come back in the form in which they were given."""

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted
from rigs import arm

import nnhydro
from nnhydro.dynamics.arrays import rows
from nnhydro.errors import ModelError
from nnhydro.models.strip_theory import StripTheory


def theory(a, loads=None, instruments=()):
    return StripTheory(a, GIVEN, {}, "physics", planted(a) if loads is None else loads, tuple(instruments))


def test_numbers_come_back_as_they_were_given():
    dynamics = nnhydro.Dynamics(theory(arm(2)))
    assert dynamics.inverse_dynamics([0.1, 0.2], [0, 0], [0, 0]).shape == (2,)
    assert dynamics.mass_matrix(np.zeros((4, 3, 2))).shape == (4, 3, 2, 2)
    q = torch.zeros(5, 2, dtype=torch.float64, requires_grad=True)
    tau = dynamics.inverse_dynamics(q, torch.ones(2), torch.ones(2))
    assert isinstance(tau, torch.Tensor)
    tau.sum().backward()
    assert q.grad is not None


def test_leading_axes_are_broadcast_and_given_back():
    form, (q, u0) = rows(2, {"q": np.zeros((3, 1, 2))}, {"u0": np.arange(4.0)})
    assert form.lead == (3, 4)
    assert q.shape == (12, 2)
    assert u0.tolist() == [0.0, 1.0, 2.0, 3.0] * 3
    assert form.out(q).shape == (3, 4, 2)


@pytest.mark.parametrize(("vectors", "scalars", "line"), [
    ({"q": [1.0, float("nan")]}, {}, "q holds NaN"), ({"q": [1.0]}, {}, "this arm has 2 joint"), ({"q": "no"}, {}, "not an array"),
    ({"q": np.zeros((3, 2))}, {"u0": np.zeros(4)}, "leading axes do not fit together")])
def test_what_is_no_state_is_refused(vectors, scalars, line):
    with pytest.raises(ModelError, match=line):
        rows(2, vectors, scalars)
