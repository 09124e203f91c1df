"""Gains are the slopes of the torque, exact or by differences."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
import torch
from campaigns import DEFAULT_LAWS, GIVEN, campaign, planted
from rigs import arm, run, states

from nnhydro.errors import ModelError
from nnhydro.features.wake import STATES, STRIPS
from nnhydro.fitting.network.train import train
from nnhydro.models.gains.matrix import INPUTS, differences, gain_matrix
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.motion import Motion

NEAR = {"rtol": 1e-5, "atol": 2e-6}  # of central differences with a step of 1e-5: round-off 1e-10, kinks of |x| within a step


def theory(a, loads=None):
    return StripTheory(a, GIVEN, {}, "constant", planted(a) if loads is None else loads)


@pytest.fixture(scope="module")
def hybrid():
    a = arm(2)
    return train(campaign(a, planted(a).plus("friction", CoulombTerm((0.05, 0.05))), 4, seconds=2.0, rate=50.0), DEFAULT_LAWS)


def test_one_link_in_rotation_has_the_damping_of_the_integrated_drag():
    a, w = arm(1), np.linspace(-3, 3, 13)
    motion = Motion.at(np.zeros((13, 1)), w[:, None], np.zeros((13, 1)))
    got = gain_matrix(theory(a), motion).of_joint("qd", 0)
    want = 2 * 0.9 / 8 * a.fluid.density_kg_m3 * a.D[0] * a.L[0] ** 4 * np.abs(w)
    np.testing.assert_allclose(got.numpy(), want, rtol=1e-12, atol=1e-12)


def test_one_link_has_the_inertia_of_arm_and_water():
    a = arm(1)
    link = a.links[0]
    got = gain_matrix(theory(a), states(1)).of_joint("qdd", 0)
    water = 0.8 * a.fluid.density_kg_m3 * pi * a.D[0] ** 2 / 4 * a.L[0] ** 3 / 3
    want = link.inertia_kg_m2 + link.mass_kg * link.com_m**2 + water
    np.testing.assert_allclose(got.numpy(), want, rtol=1e-12)


@pytest.mark.parametrize("links", [1, 2, 3])
def test_inertia_of_the_constant_model_is_the_linear_part_in_the_acceleration(links):
    a, motion = arm(links), states(links)
    model, gains = theory(a), gain_matrix(theory(a), motion)
    still = replace(motion, qdd=torch.zeros_like(motion.qdd))
    change = torch.einsum("nji,ni->nj", gains.qdd, motion.qdd)
    torch.testing.assert_close(model.torque(motion) - model.torque(still), change, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("drive", ["direct", {"kind": "remote", "pulley_ratio": 1.5}])
@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_exact_gains_are_those_of_finite_differences(drive, gravity):
    model, motion = theory(arm(2, drive=drive, gravity_m_s2=gravity)), states(2)
    for name, want in zip(INPUTS, differences(model, motion), strict=True):
        torch.testing.assert_close(getattr(gain_matrix(model, motion), name), want, **NEAR)


@pytest.mark.slow
def test_gains_of_a_trained_hybrid_are_those_of_finite_differences(hybrid):
    motion, gains = states(2, 20), gain_matrix(hybrid, states(2, 20))
    for name, want in zip(INPUTS, differences(hybrid, motion, 1e-6), strict=True):
        off = (getattr(gains, name) - want).abs() / (want.abs().max() + 1e-9)
        assert float(off.flatten().quantile(0.95)) < 1e-5, name  # the rest: a step that crosses the end of a held input
    torch.testing.assert_close(gains.tau, hybrid.torque(motion))


def test_gains_are_finite_at_rest_where_scales_have_a_kink(hybrid):
    gains = gain_matrix(hybrid, Motion.at(np.zeros((3, 2)), 0.0, 0.0))
    assert all(bool(getattr(gains, name).isfinite().all()) for name in INPUTS)
    assert bool((gains.of_joint("qdd", 0) > 0).all())


def test_a_wake_that_is_empty_gives_other_gains_than_a_developed_one(hybrid):
    motion = Motion.at(np.full((1, 2), 0.3), np.full((1, 2), 1.0), 0.0)
    empty = replace(motion, wake=torch.zeros(STATES, 1, 2, STRIPS, dtype=torch.float64))
    assert not torch.allclose(gain_matrix(hybrid, motion).qd, gain_matrix(hybrid, empty).qd, rtol=1e-5)


def test_a_run_in_time_order_has_no_gains():
    with pytest.raises(ModelError, match=r"Motion\.at"):
        gain_matrix(theory(arm(2)), run(2))


def test_states_of_another_arm_are_refused():
    with pytest.raises(ModelError, match="1 joint"):
        gain_matrix(theory(arm(2)), states(1))


class OutsideTorch(TorqueModel):
    """A model that computes in numpy, as a plug-in might."""

    def torque(self, motion):
        return torch.from_numpy(NormalDrag((1.0, 1.0)).torque(Flow(self.arm, motion)).numpy())

    def document(self):
        return {}


def test_a_model_that_computes_outside_torch_gets_differences():
    a = arm(2)
    inside = theory(a, Loads({"drag": NormalDrag((1.0, 1.0))}))
    got, want = (gain_matrix(model, states(2)) for model in (OutsideTorch(a, GIVEN, {}), inside))
    torch.testing.assert_close(got.qd, want.qd, **NEAR)
