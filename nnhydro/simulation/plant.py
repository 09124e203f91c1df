"""The arm as a mechanical system: mass matrix, remaining torque and acceleration, taken from the load terms themselves.

    tau = M(q) qdd + h(t, q, qd, u0, du0)                   [N m]

    h     torque of all terms at qdd = 0;   column k of M: torque at qdd = e_k, minus h

The terms must be affine in qdd and depend on the present alone, or on what can be carried from step to step (physics/carried.py):
`require_steps` finds out by trying.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import final

import torch
from torch import Tensor

from nnhydro.dynamics.inertia import mass_and_bias
from nnhydro.dynamics.joint_model import fast_stepper
from nnhydro.errors import ConfigError, require
from nnhydro.physics.carried import Memory, StepMemory
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm

SAME = 1e-9  # relative: torques that should agree differ by rounding only


@final
@dataclass(frozen=True, eq=False)
class Plant:
    """The arm under its loads; every method takes a batch of m independent states."""

    arm: Arm
    loads: Loads

    def begin(self, q: Tensor, qd: Tensor, u0: Tensor) -> Memory:
        """Return what is remembered where a run begins in the states q, qd (m, joints), u0 (m,); empty where nothing is."""
        carried = StepMemory(torch.zeros(len(q), dtype=torch.float64))
        self._torque(Motion(carried.dt, q, qd, torch.zeros_like(q), u0, torch.zeros_like(u0), steady=True, carried=carried))
        return carried.after

    def following(self, memory: Memory, q: Tensor, qd: Tensor, u0: Tensor, dt: float) -> Memory:
        """Return what is remembered in the states q, qd (m, joints), u0 (m,), `dt` s after `memory`."""
        if not memory:
            return memory
        carried = StepMemory(torch.full((len(q),), dt, dtype=torch.float64), memory)
        self._torque(Motion(carried.dt, q, qd, torch.zeros_like(q), u0, torch.zeros_like(u0), steady=True, carried=carried))
        return carried.after

    def _torque(self, motion: Motion) -> Tensor:
        """The torques (n, joints) N m of all terms; with a memory, by terms that can be stepped."""
        return (self.loads if motion.carried is None else self._stepped).torque(Flow(self.arm, motion))

    @cached_property
    def _stepped(self) -> Loads:
        return Loads({name: fast_stepper(term) for name, term in self.loads.terms.items()})

    def mass_and_rest(self, t: Tensor, q: Tensor, qd: Tensor, u0: Tensor, du0: Tensor, memory: Memory | None = None,
                      dt: float = 0.0) -> tuple[Tensor, Tensor]:
        """Return M (m, joints, joints) kg m^2 and h (m, joints) N m; t, u0, du0 (m,), q, qd (m, joints), `memory` that of `dt` s ago."""
        def torque(qdd: Tensor) -> Tensor:
            """Return the torques (m, k, joints) N m at the accelerations `qdd` (m, k, joints) rad/s^2."""
            m, k, n = qdd.shape

            def each(x: Tensor) -> Tensor:
                return x.repeat_interleave(k, dim=0)

            carried = StepMemory(torch.full((m * k,), dt, dtype=torch.float64), {name: each(x) for name, x in memory.items()},
                                 frozen=dt == 0) if memory else None
            motion = Motion(each(t), each(q), each(qd), qdd.reshape(m * k, n), each(u0), each(du0), steady=carried is not None,
                            carried=carried)
            return self._torque(motion).reshape(m, k, n)

        return mass_and_bias(torque, q)

    def acceleration(self, tau: Tensor, t: Tensor, q: Tensor, qd: Tensor, u0: Tensor, du0: Tensor, memory: Memory | None = None,
                     dt: float = 0.0) -> Tensor:
        """Return qdd (m, joints) rad/s^2 under the drive torques `tau` (m, joints) N m at the joints; not finite where M is singular."""
        mass, rest = self.mass_and_rest(t, q, qd, u0, du0, memory, dt)
        qdd: Tensor = torch.linalg.solve_ex(mass, tau - rest).result
        return qdd

    def require_inertia(self, t: Tensor, q: Tensor, u0: Tensor) -> None:
        """Raise ConfigError unless the mass matrix is positive definite at the angles `q` (m, joints)."""
        mass, _ = self.mass_and_rest(t, q, torch.zeros_like(q), u0, torch.zeros_like(u0))
        eigenvalues = torch.linalg.eigvalsh((mass + mass.transpose(1, 2)) / 2)
        require(bool((eigenvalues[:, 0] > 1e-9 * eigenvalues[:, -1].abs()).all()), "the arm has no inertia (masses 0 in "
                "arm.yaml?), so no torque moves it: give it masses, or let it follow its motions with 'controller: none'")


def _last_torque(term: LoadTerm, arm: Arm, past: float, qdd: Tensor, steady: bool = False) -> Tensor:
    """Torque (joints,) at the end of a motion that ends in one and the same state, whatever `past` was; `steady`: of that state alone."""
    t = torch.linspace(-1.0, 0.0, 41, dtype=torch.float64)[:, None]
    j = torch.arange(1.0, arm.n_links + 1, dtype=torch.float64)
    q = 0.3 * j + 0.5 * j * t + qdd * t**2 / 2 + past * t**3
    qd = 0.5 * j + qdd * t + 3 * past * t**2
    t1 = t[:, 0]
    motion = Motion(t1 + 1.0, q, qd, qdd + 6 * past * t, 0.4 + 0.2 * t1 + 0.1 * past * t1**2, 0.2 + 0.2 * past * t1, steady)
    return term.torque(Flow(arm, motion))[-1]


def _differ(a: Tensor, b: Tensor) -> bool:
    return bool((a - b).abs().max() > SAME * (1.0 + a.abs().max()))


def _carries(term: LoadTerm, arm: Arm) -> bool:
    """Whether the memory of `term` can be carried from step to step."""
    zero = torch.zeros(1, arm.n_links, dtype=torch.float64)
    return bool(Plant(arm, Loads({"term": term})).begin(zero, zero, zero[:, 0]))


def require_steps(loads: Loads, arm: Arm) -> None:
    """Raise ConfigError naming the term of `loads` that remembers the motion in a way that cannot be stepped, or is not affine in qdd."""
    low, high = torch.full((arm.n_links,), -1.0, dtype=torch.float64), torch.full((arm.n_links,), 3.0, dtype=torch.float64)
    for name, term in loads.terms.items():
        carries = _carries(term, arm)
        now = _last_torque(term, arm, 0.0, low, carries)
        if not carries and any(_differ(now, _last_torque(term, arm, past, low)) for past in (2.0, -2.0)):
            raise ConfigError(f"terms.{name}: depends on the motion before, which a simulation under a controller cannot step through: "
                              "use 'controller: none', where the arm follows its motions exactly")
        middle = _last_torque(term, arm, 0.0, (low + high) / 2, carries)
        if _differ(middle, (now + _last_torque(term, arm, 0.0, high, carries)) / 2):
            raise ConfigError(f"terms.{name}: is not proportional to the acceleration, which a simulation under a controller needs: "
                              "use 'controller: none', where the arm follows its motions exactly")
