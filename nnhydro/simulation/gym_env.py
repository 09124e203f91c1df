"""`nnhydro/ArmInWater-v0` for gymnasium (extra `rl`): an arm in water that is to bring its joints to a goal.

    import gymnasium, nnhydro.simulation.gym_env
    env = gymnasium.make("nnhydro/ArmInWater-v0", model="my_model")

action       torques at the joints, -1 to 1, in units of `torque_Nm`
observation  cos q, sin q, qd, and goal - q, wrapped to -pi ... pi                                    (5 joints,)
reward       -|goal - q|^2 - 1e-3 |action|^2, each step

The physics is that of `Dynamics`, memory of the water included, compiled where the system has a C compiler.
"""

from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.deployment.native import NativeArm, compiler
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.errors import missing_extra, require
from nnhydro.models.baselines import BASELINES
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.arm import parse_arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.simulation.native_loop import stepped_once

try:
    import gymnasium
    from gymnasium import spaces
except ImportError:
    missing_extra("gymnasium", "rl", "nnhydro/ArmInWater-v0")

Array = NDArray[np.float64]
NAME = "nnhydro/ArmInWater-v0"
LINKS = [{"length_m": 0.55, "diameter_m": 0.07, "mass_kg": 1.0, "com_m": 0.27, "inertia_kg_m2": 0.026},
         {"length_m": 0.45, "diameter_m": 0.06, "mass_kg": 1.4, "com_m": 0.22, "inertia_kg_m2": 0.024}]
FASTEST = 50.0  # rad/s: beyond it an episode ends


def _default() -> StripTheory:
    """The two-link arm of docs/examples with McLain & Rock's curves."""
    arm = parse_arm({"fluid": {"density_kg_m3": 1000.0}, "links": LINKS}, "arm")
    return StripTheory(arm, Preparation(None), {}, "state", BASELINES["state"].start(arm))


@final
class ArmInWater(gymnasium.Env[Array, Array]):
    """The environment; `model` is a model or the folder of one, `dt` s a step of `substeps` steps of the simulation."""

    metadata = {"render_modes": []}  # noqa: RUF012  # gymnasium's own form

    def __init__(self, model: Any = None, torque_Nm: float | tuple[float, ...] = (20.0, 8.0), dt: float = 0.02, substeps: int = 4) -> None:
        require(dt > 0 and substeps >= 1, f"dt = {dt!r}, substeps = {substeps!r}: give a positive time and at least one step")
        self.dynamics = Dynamics(_default() if model is None else Path(model) if isinstance(model, str) else model)
        n = self.dynamics.nq
        self.torque = np.broadcast_to(np.asarray(torque_Nm, dtype=float)[..., :n], (n,))
        self.dt, self.substeps = dt, substeps
        self.native = NativeArm(self.dynamics.model, self.dynamics.affine) if compiler() else None
        self.action_space = spaces.Box(-1.0, 1.0, (n,), np.float64)
        high = np.concatenate([np.ones(2 * n), np.full(n, FASTEST + 50.0), np.full(n, np.pi)])
        self.observation_space = spaces.Box(-high, high, dtype=np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Begin at rest in a posture drawn at random, with a goal drawn at random; `options` may give q and goal."""
        super().reset(seed=seed)
        n, given = self.dynamics.nq, options or {}
        drawn = self.np_random.uniform(-1.2, 1.2, (2, n))
        self.q, self.goal = (np.array(given.get(name, x), dtype=float) for name, x in zip(("q", "goal"), drawn, strict=True))
        self.qd = np.zeros(n)
        self.state = self.dynamics.reset(self.q)
        if self.native is not None:
            self.native.begin()
            self.native.torque(self.q, self.qd, self.qd)
        return self._observation(), {}

    def _off(self) -> Array:
        return np.asarray((self.goal - self.q + np.pi) % (2 * np.pi) - np.pi)

    def _observation(self) -> Array:
        return np.concatenate([np.cos(self.q), np.sin(self.q), self.qd, self._off()])

    def _advance(self, tau: Array, h: float) -> None:
        """One step of `h` s under the torque `tau` N m, by machine code where it is there."""
        if self.native is None:
            self.state = self.dynamics.step(self.state, tau, h)
            self.q, self.qd = self.state.q, self.state.qd
            return
        self.q, self.qd, qdd = stepped_once(self.native, self.q, self.qd, tau, np.zeros((3, 2)), h)
        self.native.torque(self.q, self.qd, qdd, dt=h)

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Apply `action` for `dt` s; the episode ends where the arm turns faster than FASTEST."""
        push = np.clip(np.asarray(action, dtype=float), -1.0, 1.0)
        for _ in range(self.substeps):
            self._advance(push * self.torque, self.dt / self.substeps)
        reward = -float((self._off()**2).sum()) - 1e-3 * float((push**2).sum())
        return self._observation(), reward, bool(np.abs(self.qd).max() > FASTEST), False, {}


def register() -> None:
    """Make the environment known to gymnasium."""
    if NAME not in gymnasium.registry:
        gymnasium.register(NAME, entry_point="nnhydro.simulation.gym_env:ArmInWater", max_episode_steps=250)


register()
