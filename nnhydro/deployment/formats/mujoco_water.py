"""The water of a model in somebody's MuJoCo simulation: a function that is called once a step and adds the hydrodynamic torques.

    (M_MuJoCo + F) qdd = f - g,     qfrc_applied = -(F qdd + g)         f: all that MuJoCo itself applies         [N m]

    water = model - dry arm = F qdd + g     added mass and drag, friction and payload too where the model has them

MuJoCo has no force that depends on the acceleration; an added mass put there as the force of the step before is unstable as soon as it
exceeds the link's own. Here the acceleration that arm and water have together is solved for first, and the force is what the water does at
it: MuJoCo then finds that very acceleration. The step is as stable as MuJoCo's own. A learned model's water is linearised about the
acceleration of the step before. Use a MuJoCo arm without its fluid model (density 0), q as in conventions.py.
"""

from collections.abc import Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.dynamics.dynamics import ArmState, Dynamics
from nnhydro.errors import ModelError, require
from nnhydro.models.baselines import BASELINES
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.filtering.preprocessing import Preparation

Array = NDArray[np.float64]


@final
class MujocoWater:
    """The water of `model` (a Model, a torque model, or a folder) for the hinges `joints` of a MuJoCo model, all of them by default.

    Call it between mj_step1 and mj_step2, or before mj_step. Raises ModelError where the joints do not fit.
    """

    def __init__(self, model: Any, mj_model: Any, joints: Sequence[str] | None = None) -> None:
        self.dynamics = Dynamics(model)
        arm = self.dynamics.arm
        self.dry = Dynamics(StripTheory(arm, Preparation(None), {}, "rigid", BASELINES["rigid"].start(arm)))
        self.mj = mj_model
        at = range(mj_model.njnt) if joints is None else [mj_model.joint(name).id for name in joints]
        require(len(at) == arm.n_links, f"the model's arm has {arm.n_links} joint(s), MuJoCo's {len(at)}: name them in order", ModelError)
        self.q_at, self.v_at = (np.array([table[j] for j in at]) for table in (mj_model.jnt_qposadr, mj_model.jnt_dofadr))
        self.state: ArmState | None = None
        self.qdd = np.zeros(arm.n_links)

    def reset(self) -> None:
        """Forget the motion before: a run begins with the next call."""
        self.state, self.qdd = None, np.zeros(self.dynamics.nq)

    def _follow(self, q: Array, qd: Array, t: float) -> ArmState:
        """The state at `t` s, led along the measured motion since the call before."""
        state = self.state
        if state is None:
            self._began, self.state = t, self.dynamics.reset(q, qd)
        elif t - self._began > state.t:
            self.state = self.dynamics.follow(state, q, qd, t - self._began - state.t)
        assert self.state is not None
        return self.state

    def water(self, q: Array, qd: Array, state: ArmState) -> tuple[Array, Array]:
        """Return F (joints, joints) kg m^2 and g (joints,) N m of the model less the dry arm."""
        full, dry = (model.mass_matrix(q, qd, state=s) for model, s in ((self.dynamics, state), (self.dry, None)))
        whole = self.dynamics.inverse_dynamics(q, qd, self.qdd, state=state) - self.dry.inverse_dynamics(q, qd, self.qdd)
        F = full - dry
        return F, whole - F @ self.qdd

    def __call__(self, data: Any) -> Array:
        """Add the water's torques at the state of `data` to its qfrc_applied; returns them (joints,) N m."""
        import mujoco

        data.qfrc_applied[self.v_at] = 0.0
        mujoco.mj_forward(self.mj, data)
        q, qd = data.qpos[self.q_at].copy(), data.qvel[self.v_at].copy()
        F, g = self.water(q, qd, self._follow(q, qd, data.time))
        dry_mass = np.zeros((self.mj.nv, self.mj.nv))
        try:
            mujoco.mj_fullM(self.mj, data, dry_mass)
        except TypeError:  # before MuJoCo 4
            mujoco.mj_fullM(self.mj, dry_mass, data.qM)
        together, applied = dry_mass.copy(), dry_mass @ data.qacc_smooth
        together[np.ix_(self.v_at, self.v_at)] += F
        applied[self.v_at] -= g
        self.qdd = np.linalg.solve(together, applied)[self.v_at]
        torque = -(F @ self.qdd + g)
        data.qfrc_applied[self.v_at] = torque
        return torque
