"""The dynamics of an arm in water from any model, under the names that users of Pinocchio and MuJoCo know.

    tau = inverse_dynamics(q, qd, qdd),    qdd = forward_dynamics(q, qd, tau),    tau = M(q) qdd + bias(q, qd)      [N m, rad/s^2]

Torques are those at the joints, before belt and gears, without faults of sensors (`left_out` lists what of the model is no mechanics).
A state without memory stands for itself: the wake behind it has developed, as in a long steady run. `reset` begins a run, `step` follows it
with the water's memory; the `state` they give may be handed to every question, which is then asked with that memory.
Source: Featherstone (2008), Rigid Body Dynamics Algorithms, for the questions; the answers are those of the model.
"""

import warnings
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final, final

import torch
from torch import Tensor

from nnhydro.dynamics.arrays import Answer, Form, Number, rows
from nnhydro.dynamics.hub import HubWrench, hub_wrench
from nnhydro.dynamics.inertia import SAME, TorqueOf, acceleration, least_slope, mass_and_bias, runge_kutta_step, solve_inertia, tangent
from nnhydro.dynamics.joint_model import FOLLOWS, JointModel, joint_model
from nnhydro.dynamics.state import ArmState as ArmState
from nnhydro.dynamics.state import BaseMotion, Jacobians, Surroundings, step_length, surroundings
from nnhydro.errors import ModelError, ModelWarning, require
from nnhydro.models.domain import DOMAIN, Domain
from nnhydro.models.gains.matrix import gain_matrix
from nnhydro.models.storage import load_model
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.carried import Memory, StepMemory
from nnhydro.physics.motion import Motion, trial_runs
from nnhydro.recordings.arm import Arm

STILL: Final = 1e-6  # rad/s^2: no joint was accelerated
SEVERAL: Final = ("the torque of the learned model falls as a small acceleration grows (mass_matrix(q, qd, qdd) is not positive definite). "
                  "Other accelerations may give the same torque: ask a physics model, as the hybrid's baseline or the corrected model of "
                  "diagnose")


def _of(model: Any) -> TorqueModel:
    if isinstance(model, str | Path):
        return load_model(Path(model))
    inner = getattr(model, "torque_model", model)
    require(isinstance(inner, TorqueModel), f"{model!r:.80} is not a model: give what load_model, identify, train or diagnose returned, or "
            "the folder of a model", ModelError)
    assert isinstance(inner, TorqueModel)
    return inner


@final
class Dynamics:
    """The dynamics of `model`: a Model, a torque model, or the folder of one. Raises ModelError where it cannot be stepped."""

    def __init__(self, model: Any) -> None:
        self.model: JointModel = joint_model(_of(model))
        self._require_steps()

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.model.arm

    @property
    def nq(self) -> int:
        """Number of joints."""
        return self.arm.n_links

    nv = nq

    @property
    def left_out(self) -> tuple[str, ...]:
        """What of the model is no mechanics of the arm, one line each."""
        return self.model.left_out

    @cached_property
    def affine(self) -> bool:
        """Whether the torque is affine in the acceleration: true of physics models, not of learned ones."""
        run = trial_runs(self.nq)[1]
        middle, low, high = (self.model.torque(replace(run, qdd=run.qdd + x, steady=True)) for x in (1.0, -4.0, 6.0))
        return float((middle - (low + high) / 2).abs().max()) < SAME * (1 + float(high.abs().max()))

    @cached_property
    def usual_acceleration(self) -> Tensor:
        """The size (joints,) rad/s^2 of the accelerations that the model was trained on, root mean square; 1 where its record has none."""
        domain = Domain.parse(self.model.fit.get(DOMAIN))
        if domain is None:
            return torch.ones(self.nq, dtype=torch.float64)
        size = domain.states(self.arm).qdd.square().mean(dim=0).sqrt()
        return torch.where(size > STILL, size, torch.ones_like(size))

    @cached_property
    def remembers(self) -> bool:
        """Whether a torque depends on the motion before."""
        return bool(self.reset([0.0] * self.nq).memory)

    def __repr__(self) -> str:
        """Name the model, its joints, and whether it remembers."""
        inner = self.model.model
        memory = "with" if self.remembers else "without"
        return f"Dynamics({getattr(inner, 'name', inner.kind)}, {self.nq} joint(s), {memory} memory)"

    @cached_property
    def _layout(self) -> dict[str, tuple[int, ...]]:
        """Name and shape of each memory of one arm."""
        return {name: tuple(x.shape[1:]) for name, x in self.reset([0.0] * self.nq).memory.items()}

    def _require_steps(self) -> None:
        """Raise ModelError where the model remembers what cannot be carried from instant to instant."""
        runs, memory, found = trial_runs(self.nq), None, []
        with torch.no_grad():
            want = torch.stack([self.model.torque(run) for run in runs])
            for k in range(len(runs[0])):  # the runs side by side
                dt = torch.stack([run.t[k] - run.t[max(k - 1, 0)] for run in runs])
                carried = StepMemory(dt, memory)
                q, qd, qdd, u0, du0 = (torch.stack([getattr(run, name)[k] for run in runs]) for name in ("q", "qd", "qdd", "u0", "du0"))
                found.append(self.model.torque(self._motion(q, qd, qdd, u0, du0, carried)))
                memory = carried.after
        off = (torch.stack(found, dim=1) - want).abs().amax(dim=(1, 2))
        far = float((off / (want.square().mean(dim=(1, 2)).sqrt() + 1e-12)).max())
        require(far < FOLLOWS, f"this model holds a memory that cannot be stepped through time: steps differ by {far:.1e} from the "
                "whole run: use a model without that term", ModelError)

    def _motion(self, q: Tensor, qd: Tensor, qdd: Tensor, u0: Tensor, du0: Tensor, carried: StepMemory | None,
                base: Surroundings | None = None) -> Motion:
        moving = (None, None) if base is None else (base.base, base.current)
        return Motion(torch.zeros(len(q), dtype=torch.float64), q, qd, qdd, u0, du0, True, None, carried, *moving)

    def _memory_of(self, state: ArmState | None, count: int, dt: float | None = None) -> StepMemory | None:
        """The memory of `state` for `count` rows, `dt` s later, or as it is."""
        if state is None:
            return None
        require(isinstance(state, ArmState), f"state = {state!r:.80}: give what reset, step or follow returned", ModelError)
        require({name: tuple(x.shape[1:]) for name, x in state.memory.items()} == self._layout,
                "the state is of another model: begin with this one's reset", ModelError)
        if not state.memory:
            return None
        have = len(next(iter(state.memory.values())))
        require(have in (1, count), f"the state holds the memory of {have} arm(s), the question is about {count}", ModelError)
        memory = {name: x.expand(count, *x.shape[1:]) for name, x in state.memory.items()}
        return StepMemory(torch.full((count,), dt or 0.0, dtype=torch.float64), memory, frozen=dt is None)

    def _torques(self, motion: Motion) -> Tensor:
        """The torques (n, joints) N m of a motion, of none at all none."""
        return self.model.torque(motion) if len(motion) else torch.zeros_like(motion.q)

    def _at(self, q: Tensor, qd: Tensor, u0: Tensor, du0: Tensor, carried: StepMemory | None, base: Surroundings | None = None) -> TorqueOf:
        """The torques (m, k, joints) at k accelerations of each state, as a function of them (m, k, joints)."""
        def torque(qdd: Tensor) -> Tensor:
            """Return the torques (m, k, joints) N m at the accelerations `qdd` (m, k, joints) rad/s^2."""
            m, k, n = qdd.shape

            def each(x: Tensor) -> Tensor:
                return x.repeat_interleave(k, dim=0)

            repeated = None
            if carried is not None:
                memory = None if carried.before is None else {name: each(x) for name, x in carried.before.items()}
                repeated = StepMemory(each(carried.dt), memory, carried.frozen)
            turned = None if base is None else base.rows(torch.arange(m).repeat_interleave(k))
            motion = self._motion(each(q), each(qd), qdd.reshape(m * k, n), each(u0), each(du0), repeated, turned)
            return self._torques(motion).reshape(m, k, n)

        return torque

    def torque_over(self, states: Motion) -> TorqueOf:
        """Return the torques (m, k, joints) N m of `states` as a function of k accelerations of each, (m, k, joints) rad/s^2."""
        return self._at(states.q, states.qd, states.u0, states.du0, None)

    def inverse_dynamics(self, q: Number, qd: Number, qdd: Number, u0: Number = 0.0, du0: Number = 0.0, state: ArmState | None = None,
            base: BaseMotion = None) -> Answer:
        """Return the torques (..., joints) N m at the joints of a motion; q, qd, qdd (..., joints), u0, du0 (...,) of the carriage."""
        form, (q_, qd_, qdd_, u0_, du0_) = rows(self.nq, {"q": q, "qd": qd, "qdd": qdd}, {"u0": u0, "du0": du0})
        return form.out(self._torques(self._motion(q_, qd_, qdd_, u0_, du0_, self._memory_of(state, len(q_)), surroundings(base, form))))

    def _solve(self, q: Tensor, qd: Tensor, tau: Tensor, u0: Tensor, du0: Tensor, carried: StepMemory | None,
               base: Surroundings | None = None) -> Tensor:
        torque = self._at(q, qd, u0, du0, carried, base)
        if self.affine:
            mass, bias = mass_and_bias(torque, q)
            return solve_inertia(mass, tau - bias)
        with torch.no_grad():
            none = torch.zeros_like(q)
            start = solve_inertia(tangent(torque, none, self.usual_acceleration), tau - torque(none[:, None, :])[:, 0])
            found = acceleration(torque, tau, start) if len(q) else none
            if bool((least_slope(torque, found, self.usual_acceleration) <= 0).any()):
                warnings.warn(SEVERAL, ModelWarning, stacklevel=3)
        if not any(x.requires_grad for x in (q, qd, tau, u0, du0)):
            return found
        with torch.no_grad():
            mass = tangent(torque, found)
        return found + solve_inertia(mass, tau - torque(found[:, None, :])[:, 0])  # the implicit function's derivative

    def forward_dynamics(self, q: Number, qd: Number, tau: Number, u0: Number = 0.0, du0: Number = 0.0, state: ArmState | None = None,
            base: BaseMotion = None) -> Answer:
        """Return the accelerations (..., joints) rad/s^2 under the joint torques `tau` (..., joints) N m.

        Raises ModelError where the arm has no inertia, or a learned model gives that torque at no acceleration. Warns (ModelWarning)
        where several accelerations may give it.
        """
        form, (q_, qd_, tau_, u0_, du0_) = rows(self.nq, {"q": q, "qd": qd, "tau": tau}, {"u0": u0, "du0": du0})
        return form.out(self._solve(q_, qd_, tau_, u0_, du0_, self._memory_of(state, len(q_)), surroundings(base, form)))

    def mass_matrix(self, q: Number, qd: Number | None = None, qdd: Number | None = None, u0: Number = 0.0,
                    state: ArmState | None = None, base: BaseMotion = None) -> Answer:
        """Return M (..., joints, joints) kg m^2, added mass included; of a learned model the effective inertia over trained accelerations.

            M_jk = [tau_j(q, qd, a_k e_k) - tau_j(q, qd, -a_k e_k)] / 2 a_k,      a = `usual_acceleration`

        Where `qdd` is given, that of a learned model is d tau / d qdd there; at small accelerations kinks may make it negative.
        It need not be symmetric: the document's reading of the added mass and learned models have no kinetic energy behind them.
        """
        zero = [0.0] * self.nq
        vectors = {"q": q, "qd": zero if qd is None else qd, "qdd": zero if qdd is None else qdd}
        form, (q_, qd_, qdd_, u0_) = rows(self.nq, vectors, {"u0": u0})
        torque = self._at(q_, qd_, u0_, torch.zeros_like(u0_), self._memory_of(state, len(q_)), surroundings(base, form))
        if self.affine:
            return form.out(mass_and_bias(torque, q_)[0])
        return form.out(tangent(torque, qdd_, self.usual_acceleration) if qdd is None else tangent(torque, qdd_))

    def bias(self, q: Number, qd: Number, u0: Number = 0.0, du0: Number = 0.0, state: ArmState | None = None,
            base: BaseMotion = None) -> Answer:
        """Return the torques (..., joints) N m without joint accelerations: Coriolis, weight, drag, friction, the carriage's part."""
        return self.inverse_dynamics(q, qd, [0.0] * self.nq, u0, du0, state, base)

    def jacobians(self, q: Number, qd: Number, qdd: Number, u0: Number = 0.0, du0: Number = 0.0, state: ArmState | None = None,
            base: BaseMotion = None) -> Jacobians:
        """Return d tau / d (q, qd, qdd, u0, du0) at a fixed memory: exact, at kinks the mean of the slopes on both sides."""
        form, (q_, qd_, qdd_, u0_, du0_) = rows(self.nq, {"q": q, "qd": qd, "qdd": qdd}, {"u0": u0, "du0": du0})
        found = gain_matrix(self.model, self._motion(q_, qd_, qdd_, u0_, du0_, self._memory_of(state, len(q_)), surroundings(base, form)))
        return Jacobians(*(form.out(getattr(found, name)) for name in ("q", "qd", "qdd", "u0", "du0")))

    def hub_wrench(self, q: Number, qd: Number, qdd: Number, u0: Number = 0.0, du0: Number = 0.0, state: ArmState | None = None,
            base: BaseMotion = None) -> HubWrench:
        """Return force and moment that the arm exerts on its base at joint 1, in world axes, rigid and fluid part (dynamics/hub.py)."""
        form, (q_, qd_, qdd_, u0_, du0_) = rows(self.nq, {"q": q, "qd": qd, "qdd": qdd}, {"u0": u0, "du0": du0})
        found = hub_wrench(self.model, self._motion(q_, qd_, qdd_, u0_, du0_, self._memory_of(state, len(q_)), surroundings(base, form)))
        return HubWrench(form.out(found.rigid), form.out(found.fluid))

    def reset(self, q: Number, qd: Number | None = None, u0: Number = 0.0, base: BaseMotion = None) -> ArmState:
        """Return the state at the beginning of a run: what is at rest starts in water at rest, what moves has long moved at that speed."""
        form, (q_, qd_, u0_) = rows(self.nq, {"q": q, "qd": [0.0] * self.nq if qd is None else qd}, {"u0": u0})
        memory = self._memory_at(q_, qd_, u0_, StepMemory(torch.zeros_like(u0_)), surroundings(base, form))
        return ArmState(form.out(q_), form.out(qd_), form.out(u0_), 0.0, memory)

    def _memory_at(self, q: Tensor, qd: Tensor, u0: Tensor, carried: StepMemory, base: Surroundings | None) -> Memory:
        """What is remembered at an instant, by what is `carried` to it."""
        with torch.no_grad():
            self._torques(self._motion(q, qd, torch.zeros_like(q), u0, torch.zeros_like(u0), carried, base))
        return carried.after

    def follow(self, state: ArmState, q: Number, qd: Number, dt: float, u0: Number | None = None, base: BaseMotion = None) -> ArmState:
        """Return the state after the arm has moved to `q`, `qd` in `dt` s: for a motion that is measured, not computed.

        `base` is the motion of base and water after these `dt` s. Raises ModelError where `dt` is not positive.
        """
        require(isinstance(state, ArmState), f"state = {state!r:.80}: give what reset, step or follow returned", ModelError)
        form, (q_, qd_, u0_) = rows(self.nq, {"q": q, "qd": qd}, {"u0": state.u0 if u0 is None else u0})
        return self._after(state, form, q_, qd_, u0_, step_length(dt), surroundings(base, form))

    def step(self, state: ArmState, tau: Number, dt: float, du0: Number = 0.0, base: BaseMotion = None) -> ArmState:
        """Return the state `dt` s later under the joint torques `tau` (..., joints) N m and the carriage's acceleration, both held.

        One step of the classical Runge-Kutta method, whose stages see the memory advanced to their own instants. `base` is the motion of
        base and water at the beginning of the step; its accelerations are held.

        Raises ModelError where `dt` is not positive, the arm has no inertia, or a learned model gives that torque at no acceleration.
        """
        require(isinstance(state, ArmState), f"state = {state!r:.80}: give what reset, step or follow returned", ModelError)
        dt = step_length(dt)
        form, (q, qd, tau_, u0, du0_) = rows(self.nq, {"q": state.q, "qd": state.qd, "tau": tau}, {"u0": state.u0, "du0": du0})
        around = surroundings(base, form)

        def slope(half: int, q: Tensor, qd: Tensor, _near: Tensor | None) -> Tensor:
            """Return the accelerations rad/s^2 `half` dt/2 s into the step, at `q` rad and `qd` rad/s."""
            h = half * dt / 2
            carried = self._memory_of(state, len(q), h) if h else self._memory_of(state, len(q))
            return self._solve(q, qd, tau_, u0 + h * du0_, du0_, carried, None if around is None else around.after(h))

        after, speed, _ = runge_kutta_step(slope, q, qd, dt)
        return self._after(state, form, after, speed, u0 + dt * du0_, dt, None if around is None else around.after(dt))

    def _after(self, state: ArmState, form: Form, q: Tensor, qd: Tensor, u0: Tensor, dt: float, base: Surroundings | None) -> ArmState:
        carried = self._memory_of(state, len(q), dt)
        memory = {} if carried is None else self._memory_at(q, qd, u0, carried, base)
        return ArmState(form.out(q), form.out(qd), form.out(u0), state.t + dt, memory)
