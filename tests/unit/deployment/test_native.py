"""A compiled arm moves as the dynamics do."""

import numpy as np
import pytest
from campaigns import planted
from rigs import arm
from stepped import long_run, theory

from nnhydro.deployment.native import NativeArm, compiler
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.physics.travel.state_model import state_loads

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler here")


@pytest.mark.slow
@pytest.mark.parametrize("make", [planted, state_loads])
def test_a_compiled_arm_moves_as_the_dynamics_do(make):
    a = arm(2)
    dynamics = Dynamics(theory(a, make(a)))
    native, state = NativeArm(dynamics.model, dynamics.affine), dynamics.reset([0.1, 0.2])
    native.torque([0.1, 0.2], [0, 0], [0, 0])
    for _ in range(5):
        got = native.acceleration(state.q, state.qd, [1.0, -0.5])
        np.testing.assert_allclose(got, dynamics.forward_dynamics(state.q, state.qd, [1.0, -0.5], state=state), atol=1e-9)
        state = dynamics.follow(state, state.q + 0.01, state.qd + 0.3, 0.01)
        native.torque(state.q, state.qd, got, dt=0.01)
    motion = long_run(200)
    native.begin()
    through = [native.torque(*row, dt=2e-3) for row in zip(motion.q.numpy(), motion.qd.numpy(), motion.qdd.numpy(), strict=True)]
    np.testing.assert_allclose(through, dynamics.model.torque(motion), atol=1e-9)


def test_an_acceleration_is_found_where_newton_s_method_goes_to_and_fro():
    native = object.__new__(NativeArm)  # of a torque sign(a) sqrt|a|, on which Newton's step from a leads to -a
    native._known, native.affine, native.forward, native.n = None, False, None, 2
    native.torque = lambda q, qd, qdd, *others, **keys: np.sign(qdd) * np.sqrt(np.abs(qdd))
    np.testing.assert_allclose(native.acceleration([0, 0], [0, 0], [0.0, 0.0], start=[4.0, -2.0]), 0.0, atol=1e-4)
