"""MuJoCo with our water, gymnasium's environment, and coefficients that are adapted while the arm moves."""

import gymnasium
import numpy as np
import pytest
import torch
from campaigns import GIVEN, dry, planted
from rigs import arm

import nnhydro.simulation.gym_env  # noqa: F401  # makes the environment known
from nnhydro.deployment.formats.mujoco import mujoco_xml
from nnhydro.deployment.formats.mujoco_water import MujocoWater
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.effects.hypotheses.payload_mass import PayloadMass
from nnhydro.errors import ConfigError, ModelError
from nnhydro.fitting.linear.recursive import RecursiveFit
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.motion import Motion, tensor
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


@pytest.mark.slow
def test_the_environment_keeps_gymnasium_s_contract_and_repeats_itself():
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("nnhydro/ArmInWater-v0", model=theory(arm(2), planted(arm(2))))
    check_env(env.unwrapped, skip_render_check=True)
    ends = []
    for _ in range(2):
        env.reset(seed=5)
        for _ in range(20):
            seen, reward, over, _, _ = env.step(np.array([0.3, -0.2]))
        ends.append(seen)
        assert not over
        assert reward < 0
    np.testing.assert_array_equal(*ends)


@pytest.mark.slow
def test_the_environment_is_the_dynamics_compiled_or_not():
    from nnhydro.simulation.gym_env import ArmInWater

    env = ArmInWater(theory(arm(1), state_loads(arm(1))))
    seen = []
    for native in (env.native, None):
        env.native = native
        env.reset(seed=1, options={"q": [0.1], "goal": [0.5]})
        for _ in range(3):
            found = env.step(np.array([0.5]))[0]
        seen.append(found)
    np.testing.assert_allclose(*seen, atol=1e-9)


def measured(a, loads, seconds=6.0, dt=0.01, seed=0, payload=None):
    """q, qd, qdd, tau of a motion from rest; a payload is picked up half-way."""
    t = np.arange(0, seconds, dt)
    w, size = np.array([2.1, 3.3]), np.array([0.7, 0.6])
    q, qd, qdd = size * (1 - np.cos(w * t[:, None])), size * w * np.sin(w * t[:, None]), size * w**2 * np.cos(w * t[:, None])
    still = torch.zeros(len(t), dtype=torch.float64)
    motion = Motion(tensor(t), tensor(q), tensor(qd), tensor(qdd), still, still)
    tau = loads.torque(Flow(a, motion)).numpy()
    if payload is not None:
        tau[len(t) // 2:] += payload.torque(Flow(a, motion)).numpy()[len(t) // 2:]
    return q, qd, qdd, tau + 0.02 * np.random.default_rng(seed).standard_normal(tau.shape)


@pytest.mark.slow
def test_coefficients_are_found_while_the_arm_moves_and_their_deviations_hold():
    a, adapted = arm(2), ["normal_drag", "added_mass", "rub"]
    begin, true = planted(a, (0.5,) * 3, (0.2,) * 3).plus("rub", ViscousTerm((0.0, 0.0))), planted(a).plus("rub", ViscousTerm((0.3, 0.1)))
    fit = RecursiveFit(theory(a, begin), adapted, std=1.0, noise_Nm=0.02, forgetting=1.0)
    for row in zip(*measured(a, true), strict=True):
        fit.update(*row, dt=0.01)
    for found, want in zip(fit.coefficients, (0.9, 1.3, 0.8, 0.6, 0.3, 0.1), strict=True):
        assert abs(found.value - want) < 4 * found.std + 1e-6
        assert found.std < 0.05
    np.testing.assert_allclose(fit.covariance, fit.covariance.T)


@pytest.mark.slow
def test_a_payload_picked_up_in_mid_run_is_tracked():
    a = arm(2)
    loads = planted(a)
    model = theory(a, loads.plus("payload", PayloadMass((0.0,), (0.0,))))
    fit, said = RecursiveFit(model, ["payload"], std=1.0, noise_Nm=0.02, forgetting=0.97), []
    for row in zip(*measured(a, loads, payload=PayloadMass((0.4,), (0.0,))), strict=True):
        off = fit.update(*row, dt=0.01)
        said.append(fit.coefficients[0].value)
    half = len(said) // 2
    assert abs(said[half - 1]) < 0.02
    assert abs(said[half + 150] - 0.4) < 0.03
    assert np.abs(off).max() < 0.2
    assert fit.adapted_loads().terms["payload"].linear_values()[0] == said[-1]


def test_nothing_leaves_its_bounds_and_nothing_grows_without_excitation():
    a = arm(2)
    fit = RecursiveFit(theory(a, planted(a)), ["normal_drag"], std=0.5, noise_Nm=0.02, forgetting=0.9)
    q, qd, qdd, tau = measured(a, planted(a))
    for k in range(50):
        fit.update(q[k], qd[k], qdd[k], tau[k] - 5.0 * np.sign(qd[k]), dt=0.01)
    assert all(c.bounds[0] <= c.value <= c.bounds[1] for c in fit.coefficients)
    for _ in range(300):
        fit.update([0.1, 0.2], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], dt=0.01)
    assert all(c.std <= 0.5 + 1e-12 for c in fit.coefficients)
    with pytest.raises(ConfigError, match="no linear term"):
        RecursiveFit(theory(a, planted(a)), ["drag"])
