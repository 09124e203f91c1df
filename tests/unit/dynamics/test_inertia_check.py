"""States at which a model's torque does not grow with the acceleration are counted, and forward dynamics says so."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted
from rigs import arm, states

import nnhydro
from nnhydro.dynamics.inertia_check import InertiaCheck, inertia_check
from nnhydro.errors import ModelWarning
from nnhydro.models.domain import DOMAIN, Domain, inputs
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel

A = arm(2)


@dataclass(frozen=True, eq=False)
class Saturating(TorqueModel):
    """A torque of masses, less one that saturates at a small acceleration, where the first joint is bent outwards."""

    kind: ClassVar[str] = "saturating"
    less: float = 0.0

    def torque(self, motion):
        """Return the torques (n, joints)."""
        return motion.qdd - self.less * (motion.q[:, :1] > 0) * motion.qdd.clamp(-0.05, 0.05)

    def document(self):
        """Return nothing."""
        return {}


def trained(less, count=40):
    at = states(2, count)
    x = inputs(replace(at, du0=0 * at.du0), A)
    spread = x.std(axis=0)
    return Saturating(A, GIVEN, {DOMAIN: Domain(spread, x / spread, 0.1).document()}, less)


def test_the_points_of_a_region_are_states_with_the_same_inputs():
    for gravity in (0.0, 9.81):
        a = A.model_copy(update={"gravity_m_s2": gravity})
        at = states(2, 20)
        x = inputs(replace(at, du0=0 * at.du0), a)
        found = Domain(np.ones(x.shape[1]), x, 0.1).states(a)
        np.testing.assert_allclose(inputs(found, a), x, atol=1e-12)
        torch.testing.assert_close(found.qdd, at.qdd)


def test_states_where_the_torque_falls_with_the_acceleration_are_counted():
    model = trained(1.5)
    dynamics = nnhydro.Dynamics(model)
    outwards = int((Domain.parse(model.fit[DOMAIN]).states(A).q[:, 0] > 0).sum())
    found = inertia_check(model)
    assert 0 < outwards < 40
    assert (found.states, found.indefinite, found.ambiguous) == (40, 0, outwards)
    assert f"at all 40 recorded states; the least effective inertia is {found.least_kg_m2:.3g}" in found.sentence()
    assert f"At {outwards} the torque falls" in found.sentence()
    size = dynamics.usual_acceleration
    want = torch.eye(2) - torch.diag(1.5 * 0.05 / size)
    np.testing.assert_allclose(dynamics.mass_matrix([0.3, 0.1]), want, atol=1e-12)
    assert "falls" not in inertia_check(trained(0.5)).sentence()
    assert "not positive definite at 2 of 40" in InertiaCheck(40, 2, 3, -0.1).sentence()
    assert inertia_check(Saturating(A, GIVEN, {}, 0.0)) is None


def test_forward_dynamics_warns_where_several_accelerations_give_the_torque():
    dynamics = nnhydro.Dynamics(trained(1.5))
    one, other = (dynamics.inverse_dynamics([0.3, 0.1], [0.0, 0.0], [qdd, 0.0]) for qdd in (0.02, 0.065))
    np.testing.assert_allclose(one, other, atol=1e-12)
    with pytest.warns(ModelWarning, match="ask a physics model"):
        dynamics.forward_dynamics([0.3, 0.1], [0.0, 0.0], one)
    with pytest.warns(ModelWarning, match="ask a physics model"):
        dynamics.step(dynamics.reset([0.3, 0.1]), [0.1, 0.0], 0.001)
    for q, tau in (([-0.3, 0.1], one), ([0.3, 0.1], [30.0, 30.0])):
        found = dynamics.forward_dynamics(q, [0.0, 0.0], tau)
        np.testing.assert_allclose(dynamics.inverse_dynamics(q, [0.0, 0.0], found), tau, atol=1e-10)


def test_physics_is_positive_at_all_states():
    model = StripTheory(A, GIVEN, trained(0.0).fit, "physics", planted(A))
    assert inertia_check(model).ambiguous == 0
