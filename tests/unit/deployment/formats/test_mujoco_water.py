"""The water of a model in MuJoCo's simulation."""

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
