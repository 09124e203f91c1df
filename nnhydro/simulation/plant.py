"""The arm as a mechanical system: mass matrix, remaining torque and acceleration, taken from the load terms themselves.

    tau = M(q) qdd + h(t, q, qd, u0, du0)                   [N m]

    h     torque of all terms at qdd = 0;   column k of M: torque at qdd = e_k, minus h

The terms must be affine in qdd and depend on the present alone: `require_present_only` finds out by trying.
"""

from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.errors import ConfigError, require
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

    def mass_and_rest(self, t: Tensor, q: Tensor, qd: Tensor, u0: Tensor, du0: Tensor) -> tuple[Tensor, Tensor]:
        """Return M (m, joints, joints) kg m^2 and h (m, joints) N m; t, u0, du0 (m,), q, qd (m, joints)."""
        m, n = q.shape
        unit = torch.cat([torch.zeros(1, n, dtype=torch.float64), torch.eye(n, dtype=torch.float64)])

        def rows(x: Tensor) -> Tensor:
            return x.repeat_interleave(n + 1, dim=0)

        motion = Motion(rows(t), rows(q), rows(qd), unit.repeat(m, 1), rows(u0), rows(du0))
        torque = self.loads.torque(Flow(self.arm, motion)).reshape(m, n + 1, n)
        rest = torque[:, 0]
        return (torque[:, 1:] - rest[:, None, :]).transpose(1, 2), rest

    def acceleration(self, tau: Tensor, t: Tensor, q: Tensor, qd: Tensor, u0: Tensor, du0: Tensor) -> Tensor:
        """Return qdd (m, joints) rad/s^2 under the drive torques `tau` (m, joints) N m at the joints; not finite where M is singular."""
        mass, rest = self.mass_and_rest(t, q, qd, u0, du0)
        qdd: Tensor = torch.linalg.solve_ex(mass, tau - rest).result
        return qdd

    def require_inertia(self, t: Tensor, q: Tensor, u0: Tensor) -> None:
        """Raise ConfigError unless the mass matrix is positive definite at the angles `q` (m, joints)."""
        mass, _ = self.mass_and_rest(t, q, torch.zeros_like(q), u0, torch.zeros_like(u0))
        eigenvalues = torch.linalg.eigvalsh((mass + mass.transpose(1, 2)) / 2)
        require(bool((eigenvalues[:, 0] > 1e-9 * eigenvalues[:, -1].abs()).all()), "the arm has no inertia that a torque could accelerate "
                "(masses 0 in arm.yaml?): give it masses, or let it follow its motions with 'controller: none'")


def _last_torque(term: LoadTerm, arm: Arm, past: float, qdd: Tensor) -> Tensor:
    """Torque (joints,) at the end of a motion that ends in one and the same state, whatever `past` was."""
    t = torch.linspace(-1.0, 0.0, 41, dtype=torch.float64)[:, None]
    j = torch.arange(1.0, arm.n_links + 1, dtype=torch.float64)
    q = 0.3 * j + 0.5 * j * t + qdd * t**2 / 2 + past * t**3
    qd = 0.5 * j + qdd * t + 3 * past * t**2
    t1 = t[:, 0]
    motion = Motion(t1 + 1.0, q, qd, qdd + 6 * past * t, 0.4 + 0.2 * t1 + 0.1 * past * t1**2, 0.2 + 0.2 * past * t1)
    return term.torque(Flow(arm, motion))[-1]


def _differ(a: Tensor, b: Tensor) -> bool:
    return bool((a - b).abs().max() > SAME * (1.0 + a.abs().max()))


def require_present_only(loads: Loads, arm: Arm) -> None:
    """Raise ConfigError naming the term of `loads` that remembers the motion or is not affine in the acceleration."""
    low, high = torch.full((arm.n_links,), -1.0, dtype=torch.float64), torch.full((arm.n_links,), 3.0, dtype=torch.float64)
    for name, term in loads.terms.items():
        now = _last_torque(term, arm, 0.0, low)
        if any(_differ(now, _last_torque(term, arm, past, low)) for past in (2.0, -2.0)):
            raise ConfigError(f"terms.{name}: depends on the motion before, which a simulation under a controller cannot step through: "
                              "use 'controller: none', where the arm follows its motions exactly")
        middle = _last_torque(term, arm, 0.0, (low + high) / 2)
        if _differ(middle, (now + _last_torque(term, arm, 0.0, high)) / 2):
            raise ConfigError(f"terms.{name}: is not proportional to the acceleration, which a simulation under a controller needs: "
                              "use 'controller: none', where the arm follows its motions exactly")
