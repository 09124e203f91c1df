"""MuJoCo with our water, gymnasium's environment, and coefficients that are adapted while the arm moves."""

import numpy as np
import pytest
from campaigns import GIVEN, dry, planted
from rigs import arm

import nnhydro.simulation.gym_env  # noqa: F401  # makes the environment known
from nnhydro.deployment.formats.mujoco import mujoco_xml
from nnhydro.deployment.formats.mujoco_water import MujocoWater
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.errors import ModelError
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.travel.state_model import state_loads

mujoco = pytest.importorskip("mujoco")


def theory(a, loads):
    return StripTheory(a, GIVEN, {}, "physics", loads)


def test_mujoco_answers_the_same_under_the_names_of_the_manual():
    model = theory(arm(2), dry(arm(2)))
    ours, mj = Dynamics(model), mujoco.MjModel.from_xml_string(mujoco_xml(model).xml)
    data, q, qd, qdd = mujoco.MjData(mj), np.array([0.3, -0.5]), np.array([1.0, 0.2]), np.array([2.0, -1.5])
    data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
    mujoco.mj_inverse(mj, data)
    mujoco.mj_rnePostConstraint(mj, data)
    np.testing.assert_allclose(data.qfrc_inverse, ours.inverse_dynamics(q, qd, qdd), atol=1e-12)
    np.testing.assert_allclose(data.qfrc_bias - data.qfrc_passive, ours.bias(q, qd), atol=1e-12)
    moment, force = -data.cfrc_int[1].reshape(2, 3)
    moment = moment + np.cross(data.subtree_com[1], force)
    np.testing.assert_allclose([*force[:2], moment[2]], ours.hub_wrench(q, qd, qdd).total, atol=1e-12)
    slopes = np.zeros((3, 2, 2))
    mujoco.mjd_inverseFD(mj, data, 1e-6, False, *slopes, None, None, None, None)
    for found, name in zip(slopes, ("q", "qd", "qdd"), strict=True):
        np.testing.assert_allclose(found.T, getattr(ours.jacobians(q, qd, qdd), name), atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("make", [planted, state_loads])
def test_mujoco_with_our_water_accelerates_and_moves_as_our_dynamics_do(make):
    a = arm(2)
    mj = mujoco.MjModel.from_xml_string(mujoco_xml(theory(a, dry(a))).xml)
    mj.opt.timestep = 5e-4
    data, water = mujoco.MjData(mj), MujocoWater(theory(a, make(a)), mj)
    dynamics = Dynamics(theory(a, make(a)))
    data.qpos[:], tau = [0.2, 0.4], np.array([3.0, -1.0])
    state = dynamics.reset(data.qpos)
    for k in range(100):
        data.ctrl[:] = tau
        water(data)
        mujoco.mj_forward(mj, data)
        if k % 20 == 0:
            want = dynamics.forward_dynamics(data.qpos, data.qvel, tau, state=water.state)
            np.testing.assert_allclose(data.qacc, want, rtol=1e-6, atol=1e-6)
        mujoco.mj_step(mj, data)
    for _ in range(10):
        state = dynamics.step(state, tau, 5e-3)
    np.testing.assert_allclose(data.qpos, state.q, atol=2e-3)


@pytest.mark.slow
def test_an_added_mass_far_above_the_links_own_is_stable():
    a = arm(2)
    light = a.model_copy(update={"links": tuple(link.model_copy(update={"mass_kg": 0.05, "inertia_kg_m2": 0.001}) for link in a.links)})
    mj = mujoco.MjModel.from_xml_string(mujoco_xml(theory(light, dry(light))).xml)
    data, water = mujoco.MjData(mj), MujocoWater(theory(light, planted(light)), mj)
    for _ in range(200):
        data.ctrl[:] = [1.0, -0.3]
        water(data)
        mujoco.mj_step(mj, data)
    assert np.abs(data.qvel).max() < 5.0
    with pytest.raises(ModelError, match=r"3 joint\(s\), MuJoCo's 2"):
        MujocoWater(theory(arm(3), planted(arm(3))), mj)
