"""The environment keeps gymnasium's contract, and is the dynamics."""

import gymnasium
import numpy as np
import pytest
from campaigns import GIVEN, planted
from rigs import arm

import nnhydro.simulation.gym_env  # noqa: F401  # makes the environment known
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.travel.state_model import state_loads


def theory(a, loads):
    return StripTheory(a, GIVEN, {}, "physics", loads)


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
