"""MuJoCo with our water, gymnasium's environment, and coefficients that are adapted while the arm moves."""

import numpy as np
import pytest
from campaigns import GIVEN, dry
from rigs import arm

import nnhydro.simulation.gym_env  # noqa: F401  # makes the environment known
from nnhydro.deployment.formats.mujoco import mujoco_xml
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.models.strip_theory import StripTheory

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
